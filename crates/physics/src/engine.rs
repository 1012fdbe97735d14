//! The constant side of the simulation: the robot's structure, the ground, the settings.

use std::sync::Arc;

use robot::{BodyPart, RobotModel};
use spatial::{Lane, Vec3};
use terrain::HeightField;

use crate::{
    block::Parameters,
    ground::Map,
    structure::Structure,
    workspace::{Pool, Workspace},
};

/// Settings of the time step, the contact solver and the actuators.
#[derive(Clone, Debug, PartialEq)]
pub struct Config {
    /// Time step \[s\].
    pub time_step: f64,
    /// Gravity in the world \[m/s²\].
    pub gravity: [f64; 3],
    /// Gauss–Seidel sweeps over the contacts in each step.
    pub solver_sweeps: usize,
    /// Share of a penetration, and of what a joint is beyond its limit, that is corrected in one step.
    pub error_reduction: f64,
    /// Fastest correction of a penetration \[m/s\]. That of a joint limit has no such bound; but where a step's impulses would
    /// add more energy than the whole robot has at this speed, all of them are scaled down.
    pub max_depenetration_speed: f64,
    /// A contact enters the solver when its gap is below this and what it approaches by in a step \[m\].
    pub contact_margin: f64,
    /// The joint servos, the same for all joints.
    pub actuator: Actuator,
}

/// A PD servo behind a DC motor's speed–torque limit. The default has legged_gym's gains for ANYmal C
/// (`anymal_c_rough_config.py`) and the limits of Isaac Lab's ANYmal D (`lab_assets/anymal.py`).
#[derive(Clone, Debug, PartialEq)]
pub struct Actuator {
    /// Nominal proportional gain \[N m/rad or N/m\].
    pub stiffness: f64,
    /// Nominal derivative gain \[N m s/rad or N s/m\].
    pub damping: f64,
    /// Stall torque \[N m or N\]: torque available falls linearly from here to zero at `velocity_limit`.
    pub saturation_torque: f64,
    /// Largest torque at the speed a step begins with \[N m or N\]. A step that slows a joint follows the line of that speed to
    /// its end, where the torque may be more: `saturation_torque`, if the joint was on the sloping part and stops.
    pub effort_limit: f64,
    /// Speed at which no driving torque is left \[rad/s or m/s\].
    pub velocity_limit: f64,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            time_step: 0.005,
            gravity: [0.0, 0.0, -9.81],
            solver_sweeps: 6,
            error_reduction: 0.2,
            max_depenetration_speed: 1.0,
            contact_margin: 0.01,
            actuator: Actuator {
                stiffness: 80.0,
                damping: 2.0,
                saturation_torque: 120.0,
                effort_limit: 80.0,
                velocity_limit: 7.5,
            },
        }
    }
}

/// Everything the environments share.
#[derive(Clone, Debug)]
pub struct Engine<L: Lane> {
    /// The robot.
    pub robot: RobotModel,
    /// The ground, as it was given: what is stepped on is a map of it.
    terrain: Arc<HeightField>,
    map: Arc<Map>,
    /// The settings.
    pub config: Config,
    nominal: Parameters<L>,
    structure: Structure<L::Scalar>,
    pool: Pool<L>,
}

impl<L: Lane> Engine<L> {
    /// An engine for one robot on one ground. Its servos are `config.actuator`, the same for all joints: the effort and
    /// velocity limits of the robot's description are not used.
    ///
    /// # Panics
    /// If the ground has 2²⁴ cells or more, counting a rim of one around it; a `TerrainGrid` has fewer.
    pub fn new(robot: RobotModel, terrain: Arc<HeightField>, config: Config) -> Self {
        let hand = robot.contacts.iter().find(|sphere| sphere.part == BodyPart::Hand);
        let hand_position = hand.map_or_else(Vec3::zero, |hand| Vec3::splat(hand.center.to_array()));
        let structure = Structure::new::<L>(&robot);
        let nominal = Parameters {
            base_inertia: robot.links[0].inertia.broadcast(),
            friction: L::one(),
            hand_position,
            stiffness: L::splat(config.actuator.stiffness),
            damping: L::splat(config.actuator.damping),
        };
        let map = Arc::new(Map::new(&terrain));
        Self { robot, terrain, map, config, nominal, structure, pool: Pool::new() }
    }
    /// The ground.
    pub fn terrain(&self) -> &HeightField {
        &self.terrain
    }
    pub(crate) fn with_workspace(&self, work: impl FnOnce(&mut Workspace<L>)) {
        let mut workspace = self.pool.take(self);
        work(&mut workspace);
        self.pool.give_back(workspace);
    }
    pub(crate) fn map(&self) -> &Map {
        &self.map
    }
    /// Number of joints.
    pub fn num_joints(&self) -> usize {
        self.robot.joints.len()
    }
    /// Number of degrees of freedom: six of the base, one a joint.
    pub fn num_dofs(&self) -> usize {
        self.structure.num_dofs()
    }
    /// Number of contact spheres.
    pub fn num_contacts(&self) -> usize {
        self.robot.contacts.len()
    }
    /// The parameters of the undisturbed robot in every lane.
    pub fn nominal_parameters(&self) -> Parameters<L> {
        self.nominal.clone()
    }
    pub(crate) fn structure(&self) -> &Structure<L::Scalar> {
        &self.structure
    }
}
