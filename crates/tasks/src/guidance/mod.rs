//! The guidance task: a supervisor turns the force on the harness into velocity commands for a frozen locomotion policy.

mod behavior;
mod config;
mod drift;
mod environment;
mod force;
mod guided_squad;
mod metrics;
mod supervisor;
mod walker;

pub use behavior::{
    Behavior, GUIDING_SPEED_MPS, PAPER_TOTAL, PULL_THRESHOLD_X_N, PULL_THRESHOLD_Y_N, YAW_RATE_PER_NEWTON,
    behavior_reward,
};
pub use config::{COMMAND_HIGH, COMMAND_LOW, GuidanceConfig};
pub use environment::GuidanceEnv;
pub use force::{PullConfig, sensed_force};
pub use supervisor::{Supervisor, SupervisorPolicy};
pub use walker::{Course, LocomotionPolicy, SQUAD, Squad};

/// A locomotion policy that only holds the default pose: enough to stand on, and to test with.
#[cfg(test)]
pub(crate) fn test_policy() -> policy::OnnxPolicy {
    use policy::{Activation, Linear, Mlp, VecEnv as _, layout};
    let (inputs, outputs) = (layout::LOCOMOTION_OBSERVATION, layout::JOINTS);
    let layer = Linear { inputs, outputs, weight: vec![0.0; inputs * outputs], bias: vec![0.0; outputs] };
    let mlp = Mlp { layers: vec![layer], activation: Activation::Elu, output_limits: None };
    let metadata =
        crate::locomotion::LocomotionEnv::new(Default::default(), 16, 1).expect("defaults").metadata();
    policy::OnnxPolicy { mlp, metadata: metadata.into_iter().collect() }
}
