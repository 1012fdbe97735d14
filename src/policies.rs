//! Where policies come from: a file, or the ones shipped inside the program.

use std::path::Path;

use policy::{OnnxPolicy, load_onnx};
use tasks::guidance::{LocomotionPolicy, Supervisor, SupervisorPolicy};

use crate::error::{BadInput, OrBadInput as _};

/// The name of the policies inside the program.
pub const SHIPPED: &str = "shipped";

fn read(source: &str, kind: &str) -> Result<OnnxPolicy, BadInput> {
    let path = if source == SHIPPED { format!("policies/{kind}.onnx") } else { source.to_owned() };
    load_onnx(Path::new(&path)).or_bad_input(|| format!("{kind} policy {path}"))
}

/// The locomotion policy in a file, or the shipped one.
///
/// # Errors
/// The file cannot be read, is no policy, or is one for another robot.
pub fn locomotion(source: &str) -> Result<LocomotionPolicy, BadInput> {
    let file = read(source, "locomotion")?;
    LocomotionPolicy::new(file)
        .map_err(|message| BadInput::new(format!("locomotion policy {source}: {message}")))
}

/// A supervisor: `oracle`, `rules`, `dominance`, the shipped one, or the one in a file.
///
/// # Errors
/// The file cannot be read or is no supervisor.
pub fn supervisor(source: &str) -> Result<Supervisor, BadInput> {
    Ok(match source {
        "oracle" => Supervisor::Oracle,
        "rules" => Supervisor::Rules,
        "dominance" => Supervisor::Dominance,
        _ => {
            let file = read(source, "supervisor")?;
            let policy = SupervisorPolicy::new(file);
            Supervisor::Learned(
                policy.map_err(|message| BadInput::new(format!("supervisor {source}: {message}")))?,
            )
        }
    })
}
