//! Robot descriptions: URDF to [`RobotModel`], the harness, ANYmal D built in.

mod anymal;
mod error;
mod harness;
mod merge;
pub mod model;
mod query;
mod urdf;

pub use anymal::{anymal_d, anymal_d_default_joint_position};
pub use error::RobotError;
pub use model::{BodyPart, ContactSphere, Harness, Joint, JointKind, Link, RobotModel};
pub use urdf::{load_urdf, parse_urdf};
