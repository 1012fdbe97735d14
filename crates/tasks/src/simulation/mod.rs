//! Robots on a ground, in groups of sixteen: what locomotion, guidance and evaluation have in common.

mod contact_memory;
mod observation;
mod randomization;
mod reset;

use std::{ops::Range, sync::Arc};

use physics::{Block, Config, Engine};
use robot::{Harness, RobotModel};
use spatial::{Lane, f32x16};
use terrain::HeightField;

pub use contact_memory::{CONTACT_THRESHOLD_N, ContactGroups, ContactMemory};
pub use observation::BaseMotion;
pub use randomization::{Randomization, RobotConstants};
pub use reset::ResetSpread;

use crate::archive::{Archive, Archived};

/// Robots that step together, one a lane.
pub const GROUP: usize = 16;
/// Physics steps in a control step. Source: Isaac Lab, decimation 4.
pub const DECIMATION: usize = 4;
/// Control period \[s\].
pub const CONTROL_PERIOD_S: f32 = 0.02;
/// Joint target = default + this · action \[rad\]. Source: Isaac Lab.
pub const ACTION_SCALE: f32 = 0.5;
/// What moves the joints, as exported policies name it: [`physics::Actuator`].
pub(crate) const ACTUATOR: &str = "dc_motor";
/// A base tilted further than this counts as fallen: cosine of 70°.
const FALLEN_COSINE: f32 = 0.342;
/// Speeds no robot comes near in training: in 10⁷ steps of random actions, disturbances and falls on all levels the most were 3.5 m/s,
/// 10 rad/s and 23 rad/s. A soak's forces, five times as strong, throw a few as fast (docs/physics.md).
const MAX_SPEED_MPS: f64 = 30.0;
const MAX_RATE_RADPS: f64 = 50.0;
const MAX_JOINT_RATE_RADPS: f64 = 150.0;

/// Time constant of a mean over a gait's swing: longer than a stride, shorter than a command or a pull lasts \[s\].
const STRIDE_MEAN_S: f32 = 0.5;

/// Takes a control step's value into a running mean over a gait's swing.
pub(crate) fn update_stride_mean(mean: &mut f32, value: f32) {
    *mean += (value - *mean) * (CONTROL_PERIOD_S / STRIDE_MEAN_S);
}

/// Control steps in a time \[s\], at least one.
pub(crate) fn control_steps(time_s: f32) -> u32 {
    ((time_s / CONTROL_PERIOD_S).round() as u32).max(1)
}

/// Whether a time \[s\] is a multiple of the control period, as near as its number can say.
pub(crate) fn is_whole_steps(time_s: f32) -> bool {
    let steps = time_s / CONTROL_PERIOD_S;
    (steps - steps.round()).abs() <= 1e-3
}

/// What all robots share.
#[derive(Clone, Debug)]
pub struct Simulation {
    /// Robot, ground and settings.
    pub engine: Engine<f32x16>,
    /// Joint positions at action 0 \[rad\].
    pub default_joint_position: [f32; 12],
    contact_groups: ContactGroups,
}

/// Sixteen robots.
#[derive(Clone, Debug)]
pub struct Group {
    /// Their state, parameters and inputs.
    pub block: Block<f32x16>,
    /// Their contacts in the last control step.
    pub contacts: ContactMemory,
    /// Joint velocities before the last control step \[rad/s\].
    pub previous_joint_velocity: Vec<f32x16>,
}

impl Simulation {
    /// ANYmal D with the nominal harness on the given ground.
    pub fn new(terrain: Arc<HeightField>, config: Config) -> Self {
        let robot = robot::anymal_d().with_harness(Harness::default()).expect("the nominal harness is sound");
        Self {
            contact_groups: ContactGroups::new(&robot),
            default_joint_position: robot::anymal_d_default_joint_position().map(|q| q as f32),
            engine: Engine::new(robot, terrain, config),
        }
    }

    /// The robot.
    pub fn robot(&self) -> &RobotModel {
        &self.engine.robot
    }

    /// Groups for the robots with numbers `envs`, drawn from `randomization`; they still have to be reset.
    ///
    /// # Errors
    /// `envs` are not whole groups, or a range is none.
    pub fn groups(
        &self,
        envs: Range<usize>,
        randomization: &Randomization,
        seed: u64,
    ) -> Result<Vec<Group>, String> {
        if envs.is_empty() || !envs.len().is_multiple_of(GROUP) {
            return Err(format!("num_envs is {}, must be a multiple of {GROUP} above 0", envs.len()));
        }
        randomization.validate()?;
        let group = |first: usize| {
            let mut block = Block::new(&self.engine);
            for lane in 0..GROUP {
                let constants = randomization.draw(self.robot(), seed, first + lane);
                block.parameters.base_inertia.set(lane, &constants.base_inertia);
                block.parameters.friction.set(lane, constants.friction);
                block.parameters.hand_position.set(lane, constants.hand_position.to_array());
            }
            Group {
                block,
                contacts: ContactMemory::new(&self.contact_groups),
                previous_joint_velocity: vec![f32x16::ZERO; self.engine.num_joints()],
            }
        };
        Ok(envs.step_by(GROUP).map(group).collect())
    }

    /// Holds the targets of `actions` ([`GROUP`] × 12, raw) during one control step.
    pub fn control_step(&self, group: &mut Group, actions: &[f32]) {
        let joints = self.engine.num_joints();
        for j in 0..joints {
            let target = |lane: usize| {
                f64::from(self.default_joint_position[j] + ACTION_SCALE * actions[lane * joints + j])
            };
            group.block.input.joint_target[j] = f32x16::from_fn(target);
        }
        group.previous_joint_velocity.copy_from_slice(&group.block.state.joint_velocity);
        group.contacts.begin();
        for _ in 0..DECIMATION {
            group.block.step(&self.engine);
            let force = &group.block.output.contact_force;
            group.contacts.observe(&self.contact_groups, force, CONTROL_PERIOD_S / DECIMATION as f32);
        }
        group.contacts.end();
    }
}

impl Group {
    /// Whether a robot has fallen: its base touched the ground (Isaac Lab's rule), or it is tilted beyond 70°, from
    /// where no policy came back.
    pub fn has_fallen(&self, lane: usize) -> bool {
        self.contacts.base_force[lane] > CONTACT_THRESHOLD_N
            || self.base_motion(lane).gravity[2] > -FALLEN_COSINE
    }

    /// Whether a robot's state still consists of numbers that a robot can have. One that does not would teach more in a
    /// single step than all others in an iteration, and nothing true.
    pub fn is_sound(&self, lane: usize) -> bool {
        let state = &self.block.state;
        let within = |x: f64, bound: f64| x.abs() < bound;
        let each_within =
            |v: &spatial::Vec3<f32x16>, bound| v.get(lane).into_iter().all(|x| within(x, bound));
        each_within(&state.base_position, 1e4)
            && state.base_orientation.get(lane).into_iter().all(f64::is_finite)
            && each_within(&state.base_linear_velocity, MAX_SPEED_MPS)
            && each_within(&state.base_angular_velocity, MAX_RATE_RADPS)
            && state.joint_position.iter().all(|q| within(q.get(lane), 1e3))
            && state.joint_velocity.iter().all(|q| within(q.get(lane), MAX_JOINT_RATE_RADPS))
    }
}

impl Archived for Group {
    fn visit(&mut self, archive: &mut impl Archive) {
        let state = &mut self.block.state;
        let q = &mut state.base_orientation;
        for part in [&mut q.w, &mut q.x, &mut q.y, &mut q.z] {
            archive.f32s(part.as_mut_array());
        }
        let input = &mut self.block.input;
        for vector in [
            &mut state.base_position,
            &mut state.base_linear_velocity,
            &mut state.base_angular_velocity,
            &mut input.hand_force,
            &mut input.base_force,
        ] {
            for part in [&mut vector.x, &mut vector.y, &mut vector.z] {
                archive.f32s(part.as_mut_array());
            }
        }
        for lane in state.joint_position.iter_mut().chain(&mut state.joint_velocity) {
            archive.f32s(lane.as_mut_array());
        }
        let mut impulses = self.block.impulses().to_vec();
        for impulse in &mut impulses {
            for part in [&mut impulse.x, &mut impulse.y, &mut impulse.z] {
                archive.f32s(part.as_mut_array());
            }
        }
        self.block.set_impulses(&impulses);
        self.contacts.visit(archive);
    }
}
