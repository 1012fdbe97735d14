//! The state of one block of environments, one environment a lane, and what goes in and out of a step.

use spatial::{Inertia, Lane, Quat, Vec3};

use crate::engine::Engine;
use crate::ground::FACES;

/// Where the robots are and how they move.
#[derive(Clone, Debug)]
pub struct State<L> {
    /// Base origin in the world \[m\].
    pub base_position: Vec3<L>,
    /// Base attitude `q_wb`.
    pub base_orientation: Quat<L>,
    /// Velocity of the base origin, in the base frame \[m/s\].
    pub base_linear_velocity: Vec3<L>,
    /// Angular velocity of the base, in the base frame \[rad/s\].
    pub base_angular_velocity: Vec3<L>,
    /// Joint positions \[rad or m\], model order.
    pub joint_position: Vec<L>,
    /// Joint velocities \[rad/s or m/s\], model order.
    pub joint_velocity: Vec<L>,
}

/// What differs from one robot to the next and stays during an episode.
#[derive(Clone, Debug)]
pub struct Parameters<L> {
    /// Inertia of the base link with everything fixed to it (bar and hand too), about the base origin.
    pub base_inertia: Inertia<L>,
    /// Coulomb friction coefficient of every contact.
    pub friction: L,
    /// Center of the handler's hand in the base frame \[m\]: where `hand_force` acts, and its contact sphere.
    pub hand_position: Vec3<L>,
    /// Proportional gain of the joint servos \[N m/rad or N/m\].
    pub stiffness: L,
    /// Derivative gain of the joint servos \[N m s/rad or N s/m\].
    pub damping: L,
}

/// What is done to the robots during a step.
#[derive(Clone, Debug)]
pub struct Input<L> {
    /// Joint position targets \[rad or m\], model order.
    pub joint_target: Vec<L>,
    /// Force of the hand on the robot, in the heading frame \[N\], at [`Parameters::hand_position`].
    pub hand_force: Vec3<L>,
    /// Disturbance force, in the heading frame \[N\], at the base origin.
    pub base_force: Vec3<L>,
}

/// What a step reports beside the new state.
#[derive(Clone, Debug)]
pub struct Output<L> {
    /// Torques the actuators applied in the last step \[N m or N\], model order; where it changed a joint's speed they
    /// may be beyond the motor's limits, by as much as is said at
    /// [`Actuator::effort_limit`](crate::Actuator::effort_limit).
    pub joint_torque: Vec<L>,
    /// Force of the ground on each contact sphere in the last step, world frame \[N\], in the order of
    /// `RobotModel::contacts`.
    pub contact_force: Vec<Vec3<L>>,
}

/// [`Lane::WIDTH`] environments that step together.
#[derive(Clone, Debug)]
pub struct Block<L> {
    /// Where the robots are.
    pub state: State<L>,
    /// What each robot is.
    pub parameters: Parameters<L>,
    /// What acts on them.
    pub input: Input<L>,
    /// What the last step gave.
    pub output: Output<L>,
    /// Contact impulses of the last step \[N s\], world frame, one a place among all possible contacts.
    pub(crate) impulses: Vec<Vec3<L>>,
    /// The places whose impulse, or their sphere's force, may be other than zero.
    pub(crate) touched: Vec<usize>,
}

impl<L: Lane> Block<L> {
    /// Robots at the origin with zero joint positions, nominal parameters and no forces.
    pub fn new(engine: &Engine<L>) -> Self {
        let joints = engine.num_joints();
        Self {
            state: State {
                base_position: Vec3::zero(),
                base_orientation: Quat::identity(),
                base_linear_velocity: Vec3::zero(),
                base_angular_velocity: Vec3::zero(),
                joint_position: vec![L::zero(); joints],
                joint_velocity: vec![L::zero(); joints],
            },
            parameters: engine.nominal_parameters(),
            input: Input {
                joint_target: vec![L::zero(); joints],
                hand_force: Vec3::zero(),
                base_force: Vec3::zero(),
            },
            output: Output {
                joint_torque: vec![L::zero(); joints],
                contact_force: vec![Vec3::zero(); engine.num_contacts()],
            },
            impulses: vec![Vec3::zero(); FACES * engine.num_contacts()],
            touched: Vec::new(),
        }
    }

    /// Forgets contact impulses kept for warm starting; call for a lane whose state was set by hand.
    pub fn forget_contacts(&mut self, lane: usize) {
        for impulse in &mut self.impulses {
            impulse.set(lane, [0.0; 3]);
        }
    }

    /// Contact impulses of the last step \[N s\], world frame, which start the next solve: state that a
    /// continued simulation needs beside [`State`].
    pub fn impulses(&self) -> &[Vec3<L>] {
        &self.impulses
    }

    /// Replaces the impulses; `impulses` is as long as what [`Block::impulses`] gave.
    pub fn set_impulses(&mut self, impulses: &[Vec3<L>]) {
        self.impulses.copy_from_slice(impulses);
        self.touched = (0..impulses.len()).collect();
    }

    /// Advances every lane by one time step of [`Engine`]'s configuration.
    pub fn step(&mut self, engine: &Engine<L>) {
        engine.with_workspace(|workspace| crate::step::step(engine, self, workspace));
    }
}
