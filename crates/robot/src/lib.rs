//! Robot descriptions: URDF to RobotModel, the harness, ANYmal D built in.

pub mod model;

pub use model::{BodyPart, ContactSphere, Harness, Joint, JointKind, Link, RobotModel};
