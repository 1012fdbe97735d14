//! The simulation and both networks for a browser.
//!
//! [`Page`] is what the page talks to, in plain Rust and tested natively; `boundary` (WebAssembly only) is the thin layer
//! of exported functions around one of it. A [`Session`] is a ground with its robots, supervisors and pulls.

#[cfg(target_arch = "wasm32")]
mod boundary;
mod description;
mod page;
mod reading;
mod session;
mod settings;

pub use page::{Network, Page};
pub use reading::{HEADING_WINDOW_S, Reading};
pub use session::{FORCE_HIGH, FORCE_LOW, FRAME_HEADER, ROBOT_FIELDS, Session, row_width};
pub use settings::{Ground, MAX_HERD, Mind, Settings};
