//! The constant side of the simulation: the robot's structure, the ground, the settings.

use std::sync::Arc;

use robot::{Harness, RobotModel};
use spatial::{Lane, Vec3};
use terrain::HeightField;

use crate::{
    block::Parameters,
    ground::Map,
    structure::Structure,
    workspace::{Pool, Workspace},
};

/// Settings of the time step, the contact solver and the actuators. What a value may be is said in parentheses; [`Engine::new`]
/// checks it.
#[derive(Clone, Debug, PartialEq)]
pub struct Config {
    /// Time step \[s\] (above 0).
    pub time_step: f64,
    /// Gravity in the world \[m/s²\] (finite).
    pub gravity: [f64; 3],
    /// Gauss–Seidel sweeps over the contacts in each step.
    pub solver_sweeps: usize,
    /// Share of a penetration, and of what a joint is beyond its limit, that is corrected in one step (0 to 1).
    pub error_reduction: f64,
    /// Fastest correction of a penetration \[m/s\] (0 or more). That of a joint limit has no such bound. But where a
    /// step's impulses would add more energy than pushing out takes (penetrations and limits), or more than the whole
    /// robot has at this speed, all of them are scaled down.
    pub max_depenetration_speed: f64,
    /// A contact enters the solver when its gap is below this and what it approaches by in a step \[m\] (0 or more), but never
    /// above 50 mm: what approaches by more in a step, at 5 ms faster than 10 m/s, can end it inside the ground.
    pub contact_margin: f64,
    /// The joint servos, the same for all joints.
    pub actuator: Actuator,
}

/// A PD servo behind a DC motor's speed–torque limit. The default has legged_gym's gains for ANYmal C
/// (`anymal_c_rough_config.py`) and the limits of Isaac Lab's ANYmal D (`lab_assets/anymal.py`).
#[derive(Clone, Debug, PartialEq)]
pub struct Actuator {
    /// Nominal proportional gain \[N m/rad or N/m\] (0 or more).
    pub stiffness: f64,
    /// Nominal derivative gain \[N m s/rad or N s/m\] (0 or more).
    pub damping: f64,
    /// Stall torque \[N m or N\] (0 or more): torque available falls linearly from here to zero at `velocity_limit`.
    pub saturation_torque: f64,
    /// Largest torque at the speed a step begins with \[N m or N\] (0 or more). From there a step follows the law's
    /// line to the speed it ends with, however far that is: a change of speed by Δq̇ takes d Δq̇ from the torque, d
    /// being the derivative gain where neither limit holds, `saturation_torque / velocity_limit` on the sloping part, 0
    /// on the flat one. So torque is bounded by `effort_limit` + d |Δq̇| alone: on the sloping part it is
    /// `saturation_torque` where the step stops the joint, and more where it turns it around.
    pub effort_limit: f64,
    /// Speed at which no driving torque is left \[rad/s or m/s\] (above 0).
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

impl Config {
    /// Panics where a value is none that its field allows.
    fn check(&self) {
        let Self { actuator, error_reduction, gravity, .. } = self;
        let above_0 = [("time_step", self.time_step), ("actuator.velocity_limit", actuator.velocity_limit)];
        for (name, value) in above_0 {
            assert!(value > 0.0 && value.is_finite(), "{name} is {value}, must be finite and above 0");
        }
        let not_negative = [
            ("max_depenetration_speed", self.max_depenetration_speed),
            ("contact_margin", self.contact_margin),
            ("actuator.stiffness", actuator.stiffness),
            ("actuator.damping", actuator.damping),
            ("actuator.saturation_torque", actuator.saturation_torque),
            ("actuator.effort_limit", actuator.effort_limit),
        ];
        for (name, value) in not_negative {
            assert!(value >= 0.0 && value.is_finite(), "{name} is {value}, must be finite, 0 or more");
        }
        assert!(
            (0.0..=1.0).contains(error_reduction),
            "error_reduction is {error_reduction}, must be 0 to 1"
        );
        assert!(gravity.iter().all(|g| g.is_finite()), "gravity is {gravity:?}, must be finite");
    }
}

/// Panics where a field is no ground.
fn check_ground(field: &HeightField) {
    let HeightField { cell_size, origin, columns, rows, ref cells } = *field;
    let is_size = cell_size > 0.0 && cell_size.is_finite();
    assert!(is_size, "cell_size is {cell_size} m, must be finite and above 0");
    assert!(origin.iter().all(|x| x.is_finite()), "origin is {origin:?} m, must be finite");
    for (name, count) in [("columns", columns), ("rows", rows)] {
        assert!(count > 0, "{name} is {count}, must be 1 or more");
    }
    let count = cells.len();
    assert!(
        columns.checked_mul(rows) == Some(count),
        "cells has {count} entries, must have {columns} × {rows}"
    );
    for (i, cell) in cells.iter().enumerate() {
        assert!(cell.iter().all(|z| z.is_finite()), "cell {i} is {cell:?} m, must be finite");
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
    pub(crate) config: Config,
    nominal: Parameters<L>,
    structure: Structure<L::Scalar>,
    pool: Pool<L>,
}

impl<L: Lane> Engine<L> {
    /// An engine for one robot on one ground. Its servos are `config.actuator`, the same for all joints: the effort and
    /// velocity limits of the robot's description are not used.
    ///
    /// A vertical face of the ground is a wall up to 0.5 m above its foot. What meets a higher one further up, by the center of
    /// a sphere, passes into it and is lifted out at up to [`Config::max_depenetration_speed`].
    ///
    /// # Panics
    /// If a value of `config` is not finite or none that its field allows. If the ground has no cell, more or fewer of them
    /// than `columns` × `rows`, or 2²⁴ and more, counting a rim of one around it; or if its cells' size is not above 0, or
    /// size, origin or a height not finite. No `TerrainGrid` has these faults.
    pub fn new(robot: RobotModel, terrain: Arc<HeightField>, config: Config) -> Self {
        config.check();
        check_ground(&terrain);
        // Of the harness, not of the contacts: the hand pulls also where its sphere is left out.
        let hand = robot.harness.as_ref().map(Harness::hand_position);
        let hand_position = hand.map_or_else(Vec3::zero, |hand| Vec3::splat(hand.to_array()));
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
    /// The settings.
    pub fn config(&self) -> &Config {
        &self.config
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
