//! Where policies come from: a file, or the ones shipped inside the program (`policies/`, each with its card).

use std::path::Path;

use anyhow::{Context as _, Result};
use policy::{OnnxPolicy, load_onnx, read_onnx};
use tasks::guidance::{LocomotionPolicy, Supervisor, SupervisorPolicy};

use crate::error::{BadInput, OrBadInput as _};

/// The name of the policies inside the program.
pub const SHIPPED: &str = "shipped";

/// The locomotion policy inside the program.
pub const LOCOMOTION: &[u8] = include_bytes!("../policies/locomotion.onnx");
/// The supervisor inside the program.
pub const SUPERVISOR: &[u8] = include_bytes!("../policies/supervisor.onnx");

/// Supervisors that learned nothing, by name.
pub const RULES: [(&str, Supervisor); 4] = [
    ("oracle", Supervisor::Oracle),
    ("rules", Supervisor::Rules),
    ("rules-margin", Supervisor::RulesWithMargin),
    ("dominance", Supervisor::Dominance),
];

/// The supervisor of that name, if it is one of [`RULES`].
fn rule(name: &str) -> Option<Supervisor> {
    RULES.into_iter().find_map(|(known, rule)| (known == name).then_some(rule))
}

/// Checksum of both shipped policies, by which results of others are told from theirs.
pub fn shipped_checksum() -> u32 {
    crc32c::crc32c_append(crc32c::crc32c(LOCOMOTION), SUPERVISOR)
}

/// Checksum of two policies by their sources, as `results.json` has it; a program counts by its name.
///
/// # Errors
/// A file cannot be read.
pub fn checksum(locomotion: &str, supervisor: &str) -> Result<String, BadInput> {
    let bytes = |source: &str, shipped: &[u8]| match source {
        SHIPPED => Ok(shipped.to_vec()),
        name if rule(name).is_some() => Ok(name.as_bytes().to_vec()),
        path => std::fs::read(path).or_bad_input(|| path.to_owned()),
    };
    let walk = crc32c::crc32c(&bytes(locomotion, LOCOMOTION)?);
    Ok(format!("{:08x}", crc32c::crc32c_append(walk, &bytes(supervisor, SUPERVISOR)?)))
}

/// The name by which the policy in a file is asked for here.
///
/// # Errors
/// The path is not UTF-8.
pub fn name(path: &Path) -> Result<&str> {
    path.to_str().with_context(|| format!("{}: is no UTF-8", path.display()))
}

/// The policy in a file, or `shipped`.
fn read(source: &str, shipped: &[u8]) -> Result<OnnxPolicy, BadInput> {
    let file = if source == SHIPPED { read_onnx(shipped) } else { load_onnx(Path::new(source)) };
    file.or_bad_input(|| source.to_owned())
}

/// The locomotion policy in a file, or the shipped one.
///
/// # Errors
/// The file cannot be read, is no policy, or is one for another robot.
pub fn locomotion(source: &str) -> Result<LocomotionPolicy, BadInput> {
    let file = read(source, LOCOMOTION)?;
    LocomotionPolicy::new(file).map_err(|message| BadInput::new(format!("{source}: {message}")))
}

/// A supervisor: `oracle`, `rules`, `rules-margin`, `dominance`, the shipped one, or the one in a file.
///
/// # Errors
/// The file cannot be read or is no supervisor.
pub fn supervisor(source: &str) -> Result<Supervisor, BadInput> {
    if let Some(rule) = rule(source) {
        return Ok(rule);
    }
    if source != SHIPPED && !Path::new(source).exists() {
        let names = RULES.map(|(name, _)| name).join(", ");
        let message = format!("the supervisor {source} is no file; others are: {names}, {SHIPPED}");
        return Err(BadInput::new(message));
    }
    let policy = SupervisorPolicy::new(read(source, SUPERVISOR)?);
    Ok(Supervisor::Learned(policy.map_err(|message| BadInput::new(format!("{source}: {message}")))?))
}
