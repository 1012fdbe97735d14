//! The frozen locomotion policy, and the robots it walks.

use std::{fmt::Display, ops::Range, str::FromStr};

use policy::{ForwardWorkspace, Mlp, OnnxPolicy, layout};
use spatial::{Philox, Purpose};

use crate::simulation::{
    ACTION_SCALE, ACTUATOR, BaseMotion, CONTROL_PERIOD_S, GROUP, Group, Randomization, ResetSpread,
    Simulation,
};

/// Robots that go through the policy together: as many as keep the matrix products busy.
pub const SQUAD: usize = 8 * GROUP;
const OBSERVATION: usize = layout::LOCOMOTION_OBSERVATION;

/// A locomotion policy and what its file says of the robot it was trained on.
#[derive(Clone, Debug, PartialEq)]
pub struct LocomotionPolicy {
    mlp: Mlp,
    /// Gains of the joint servos \[N m/rad\], \[N m s/rad\].
    gains: [f64; 2],
}

impl LocomotionPolicy {
    /// Takes a policy read from a file.
    ///
    /// # Errors
    /// It is not for this robot and this observation; the message names what differs and what is allowed.
    pub fn new(file: OnnxPolicy) -> Result<Self, String> {
        let shape = (file.mlp.inputs(), file.mlp.outputs());
        if shape != (OBSERVATION, layout::JOINTS) {
            return Err(format!(
                "a locomotion policy of {} inputs and {} outputs, must be {OBSERVATION} and {}",
                shape.0,
                shape.1,
                layout::JOINTS
            ));
        }
        let robot = robot::anymal_d();
        let names: Vec<&str> = robot.joints.iter().map(|joint| joint.name.as_str()).collect();
        let text = |name: &str| file.metadata.get(name).map(String::as_str).unwrap_or_default();
        if text("joint_names") != names.join(",") {
            return Err(format!("joint_names is `{}`, must be `{}`", text("joint_names"), names.join(",")));
        }
        let number = |name: &str| same_number(name, text(name));
        if number("action_scale")? != f64::from(ACTION_SCALE) {
            return Err(format!("action_scale is {}, must be {ACTION_SCALE}", text("action_scale")));
        }
        let gains = [number("joint_stiffness")?, number("joint_damping")?];
        if !(1.0..=1000.0).contains(&gains[0]) || !(0.0..=100.0).contains(&gains[1]) {
            return Err(format!(
                "joint_stiffness and joint_damping are {gains:?}, must be 1 to 1000, 0 to 100"
            ));
        }
        check_list(&file, "observation_names", &layout::LOCOMOTION.map(|segment| segment.name.to_owned()))?;
        let default = robot::anymal_d_default_joint_position().map(|q| q as f32);
        check_list(&file, "default_joint_pos", &default)?;
        check_list(&file, "control_period", &[CONTROL_PERIOD_S])?;
        let actuator = physics::Config::default().actuator;
        check_list(&file, "actuator", &[ACTUATOR.to_owned()])?;
        check_list(&file, "joint_effort_limit", &[actuator.effort_limit; layout::JOINTS])?;
        check_list(&file, "saturation_torque", &[actuator.saturation_torque])?;
        check_list(&file, "velocity_limit", &[actuator.velocity_limit])?;
        let armature: Vec<f64> = robot.joints.iter().map(|joint| joint.armature).collect();
        check_list(&file, "joint_armature", &armature)?;
        Ok(Self { mlp: file.mlp, gains })
    }

    /// By which it is told from others: of everything that decides how it walks.
    pub(super) fn checksum(&self) -> u32 {
        let Mlp { layers, activation, output_limits } = &self.mlp;
        let limits = output_limits.iter().flat_map(|(low, high)| low.iter().chain(high));
        let numbers = layers.iter().flat_map(|layer| layer.weight.iter().chain(&layer.bias)).chain(limits);
        let mut bytes: Vec<u8> = numbers.flat_map(|number| number.to_le_bytes()).collect();
        bytes.extend(self.gains.iter().flat_map(|gain| gain.to_le_bytes()));
        bytes.push(*activation as u8);
        crc32c::crc32c(&bytes)
    }

    /// Weights and biases.
    pub fn num_parameters(&self) -> usize {
        self.mlp.num_parameters()
    }

    /// Settings of the physics the policy was trained in.
    pub fn physics(&self) -> physics::Config {
        let mut config = physics::Config::default();
        [config.actuator.stiffness, config.actuator.damping] = self.gains;
        config
    }
}

/// Refuses a file that has a comma-separated list of that name which is not `ours`; one value may stand for as many alike.
pub(super) fn check_list<T: FromStr + Display + PartialEq>(
    file: &OnnxPolicy,
    name: &str,
    ours: &[T],
) -> Result<(), String> {
    let Some(text) = file.metadata.get(name) else { return Ok(()) };
    let found: Result<Vec<T>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    let is_ours = |found: Vec<T>| match &found[..] {
        [one] => ours.iter().all(|our| our == one),
        found => found == ours,
    };
    if found.is_ok_and(is_ours) {
        return Ok(());
    }
    let ours: Vec<String> = ours.iter().map(T::to_string).collect();
    Err(format!("{name} is `{text}`, must be `{}`", ours.join(",")))
}

/// The number that a comma-separated list repeats.
fn same_number(name: &str, text: &str) -> Result<f64, String> {
    let refuse = || format!("{name} is `{text}`, must be one number, repeated for every joint");
    let mut numbers = text.split(',').map(|part| part.trim().parse::<f64>());
    let first = numbers.next().and_then(Result::ok).ok_or_else(refuse)?;
    if numbers.all(|number| number == Ok(first)) { Ok(first) } else { Err(refuse()) }
}

/// What all squads share: the ground, the robot, the policy.
#[derive(Clone, Debug)]
pub struct Course {
    /// Physics and sensing.
    pub simulation: Simulation,
    /// Who moves the legs.
    pub policy: LocomotionPolicy,
    /// Scale of the sensors' errors, 0 for none; 1 is Isaac Lab's.
    pub observation_noise: f32,
    /// Seed of those errors.
    pub seed: u64,
}

/// Up to [`SQUAD`] robots under velocity commands.
#[derive(Clone, Debug)]
pub struct Squad {
    /// Number of the first robot among all.
    pub first_robot: usize,
    groups: Vec<Group>,
    /// Raw actions of the last control step, robots × 12.
    actions: Vec<f32>,
    observations: Vec<f32>,
    workspace: ForwardWorkspace,
}

impl Course {
    /// Squads of `num_robots` robots drawn from `randomization`, still to be reset.
    ///
    /// # Errors
    /// `num_robots` is no multiple of sixteen, or a range is none.
    pub fn squads(&self, num_robots: usize, randomization: &Randomization) -> Result<Vec<Squad>, String> {
        self.squads_of(0..num_robots, randomization)
    }

    /// As [`Course::squads`], of the robots with these numbers among all.
    ///
    /// # Errors
    /// They are not whole groups of sixteen, or a range is none.
    pub fn squads_of(
        &self,
        robots: Range<usize>,
        randomization: &Randomization,
    ) -> Result<Vec<Squad>, String> {
        let mut groups = self.simulation.groups(robots.clone(), randomization, self.seed)?.into_iter();
        let mut squads = Vec::new();
        for first_robot in robots.step_by(SQUAD) {
            let groups: Vec<Group> = groups.by_ref().take(SQUAD / GROUP).collect();
            let robots = groups.len() * GROUP;
            squads.push(Squad {
                first_robot,
                groups,
                actions: vec![0.0; robots * layout::JOINTS],
                observations: vec![0.0; robots * OBSERVATION],
                workspace: ForwardWorkspace::default(),
            });
        }
        Ok(squads)
    }
}

impl Squad {
    /// Number of robots.
    pub fn robots(&self) -> usize {
        self.groups.len() * GROUP
    }

    /// Motion of a robot's base.
    pub fn motion(&self, robot: usize) -> BaseMotion {
        self.groups[robot / GROUP].base_motion(robot % GROUP)
    }

    /// Joint positions of a robot \[rad\].
    pub fn joint_position(&self, robot: usize) -> [f32; layout::JOINTS] {
        let state = &self.groups[robot / GROUP].block.state;
        std::array::from_fn(|joint| state.joint_position[joint].as_array()[robot % GROUP])
    }

    /// Centers of a robot's contact spheres in the world \[m\], in the order of `RobotModel::contacts`.
    pub fn contact_centers(&self, course: &Course, robot: usize) -> Vec<[f32; 3]> {
        let centers = self.groups[robot / GROUP].block.contact_centers(&course.simulation.engine);
        centers.iter().map(|center| center.get(robot % GROUP).map(|x| x as f32)).collect()
    }

    /// Appends a robot's pose to `out`: position of the base \[m\], its attitude as w, x, y, z, joint positions \[rad\].
    pub fn write_pose(&self, robot: usize, out: &mut Vec<f32>) {
        self.groups[robot / GROUP].write_pose(robot % GROUP, out);
    }

    /// Appends the [`VIEW_FIELDS`](crate::VIEW_FIELDS) of a robot that is under `command`.
    pub(crate) fn write_view(&self, robot: usize, command: [f32; 3], out: &mut Vec<f32>) {
        self.groups[robot / GROUP].write_view(robot % GROUP, command, out);
    }

    /// Whether a robot's base touched the ground in the last control step, or it is tilted beyond return, or its state is no
    /// longer made of numbers.
    pub fn has_fallen(&self, robot: usize) -> bool {
        let (group, lane) = (&self.groups[robot / GROUP], robot % GROUP);
        !group.is_sound(lane) || group.has_fallen(lane)
    }

    /// Whether a robot's state consists of numbers of a sensible size.
    pub fn is_sound(&self, robot: usize) -> bool {
        self.groups[robot / GROUP].is_sound(robot % GROUP)
    }

    /// The group a robot is in, to spoil its state in a test.
    #[cfg(test)]
    pub(super) fn group_mut(&mut self, robot: usize) -> &mut Group {
        &mut self.groups[robot / GROUP]
    }

    /// Force of the hand on the robot from now on, heading frame \[N\].
    pub fn set_hand_force(&mut self, robot: usize, force: [f32; 3]) {
        let input = &mut self.groups[robot / GROUP].block.input;
        input.hand_force.set(robot % GROUP, force.map(f64::from));
    }

    /// Puts a robot at a spawn point, without force.
    pub fn reset(
        &mut self,
        course: &Course,
        robot: usize,
        spawn: [f32; 3],
        spread: &ResetSpread,
        random: &mut Philox,
    ) {
        let group = &mut self.groups[robot / GROUP];
        course.simulation.reset(group, robot % GROUP, spawn, spread, random);
        self.actions[robot * layout::JOINTS..][..layout::JOINTS].fill(0.0);
    }

    /// One control step of all robots under `commands`, one a robot; `episode` and `step` of a robot key its sensors' errors.
    pub fn control_step(
        &mut self,
        course: &Course,
        commands: &[[f32; 3]],
        moment: impl Fn(usize) -> (u32, u32),
    ) {
        let robots = self.robots();
        for robot in 0..robots {
            let (episode, step) = moment(robot);
            let mut random =
                Philox::new(course.seed, self.first_robot + robot, episode, step, Purpose::Observation);
            let row = &mut self.observations[robot * OBSERVATION..][..OBSERVATION];
            let group = &self.groups[robot / GROUP];
            let noise = course.observation_noise;
            course.simulation.sense(group, robot % GROUP, noise, &mut random, layout::LOCOMOTION_SCAN, row);
            row[layout::VELOCITY_COMMAND.range()].copy_from_slice(&commands[robot]);
            row[layout::PREVIOUS_ACTION.range()]
                .copy_from_slice(&self.actions[robot * layout::JOINTS..][..layout::JOINTS]);
        }
        let Self { groups, actions, observations, workspace, .. } = self;
        course.policy.mlp.forward(robots, observations, actions, workspace);
        for (group, actions) in groups.iter_mut().zip(actions.chunks_exact(GROUP * layout::JOINTS)) {
            course.simulation.control_step(group, actions);
        }
    }

    /// Fills a supervisor's observation of a robot.
    pub fn sense(
        &self,
        course: &Course,
        robot: usize,
        force: [f32; 3],
        previous_command: [f32; 3],
        random: &mut Philox,
        out: &mut [f32],
    ) {
        let group = &self.groups[robot / GROUP];
        let noise = course.observation_noise;
        course.simulation.sense(group, robot % GROUP, noise, random, layout::SUPERVISOR_SCAN, out);
        out[layout::HARNESS_FORCE.range()].copy_from_slice(&force);
        out[layout::PREVIOUS_COMMAND.range()].copy_from_slice(&previous_command);
    }
}

impl crate::archive::Archived for Squad {
    fn visit(&mut self, archive: &mut impl crate::archive::Archive) {
        self.groups.iter_mut().for_each(|group| group.visit(archive));
        archive.f32s(&mut self.actions);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::guidance::test_policy;

    #[test]
    fn a_policy_of_another_shape_or_robot_is_refused_by_name() {
        let refusal = |change: &dyn Fn(&mut OnnxPolicy)| {
            let mut file = test_policy();
            change(&mut file);
            LocomotionPolicy::new(file).unwrap_err()
        };
        LocomotionPolicy::new(test_policy()).unwrap();
        assert!(refusal(&|file| file.mlp.layers[0].inputs = 48).contains("48 inputs"));
        let names = |file: &mut OnnxPolicy| file.metadata.insert("joint_names".into(), "a,b".into());
        assert!(refusal(&|file| drop(names(file))).contains("joint_names is `a,b`"));
        let mixed = |file: &mut OnnxPolicy| file.metadata.insert("joint_stiffness".into(), "80,40".into());
        assert!(refusal(&|file| drop(mixed(file))).contains("joint_stiffness is `80,40`"));
        assert!(refusal(&|file| drop(file.metadata.remove("action_scale"))).contains("action_scale"));
    }

    #[test]
    fn what_a_file_says_of_robot_and_time_is_held_against_ours() {
        let made = |name: &str, text: Option<&str>| {
            let mut file = test_policy();
            file.metadata.remove(name);
            file.metadata.extend(text.map(|text| (name.to_owned(), text.to_owned())));
            LocomotionPolicy::new(file)
        };
        let pose = "0, 0, 0, 0, 0.4000, -0.4, 0.4, -0.4, -0.8, 0.8, -0.8, 0.8";
        made("default_joint_pos", Some(pose)).unwrap();
        made("joint_effort_limit", Some("80.0")).unwrap();
        for (name, text, ours) in [
            ("default_joint_pos", "0,0,0,0,0.4,-0.4,0.4,-0.4,-0.8,0.8,-0.8,0.7", "0,0,0,0,0.4,"),
            ("default_joint_pos", "zero", "0,0,0,0,0.4,"),
            ("control_period", "0.01", "0.02"),
            ("observation_names", "height_scan", "base_linear_velocity,base_angular_velocity,"),
            ("actuator", "ideal_pd", "dc_motor"),
            ("joint_effort_limit", "70", "80,80,80,80,80,80,80,80,80,80,80,80"),
            ("joint_armature", "0,0,0,0,0,0,0,0,0,0,0,0", "0.06,0.06,"),
            ("saturation_torque", "140", "120"),
            ("velocity_limit", "8.5", "7.5"),
        ] {
            made(name, None).unwrap();
            let message = made(name, Some(text)).unwrap_err();
            assert!(message.contains(&format!("{name} is `{text}`, must be `{ours}")), "{message}");
        }
    }

    #[test]
    fn policies_that_walk_otherwise_have_other_checksums() {
        let of = |change: &dyn Fn(&mut OnnxPolicy)| {
            let mut file = test_policy();
            change(&mut file);
            LocomotionPolicy::new(file).unwrap().checksum()
        };
        let own = of(&|_| ());
        assert_eq!(of(&|file| drop(file.metadata.insert("author".into(), "nobody".into()))), own);
        let damping = ["3"; layout::JOINTS].join(",");
        let changes: [&dyn Fn(&mut OnnxPolicy); 5] = [
            &|file| file.mlp.layers[0].weight[7] = 0.1,
            &|file| file.mlp.layers[0].bias[11] = 0.1,
            &|file| file.mlp.activation = policy::Activation::Tanh,
            &|file| file.mlp.output_limits = Some((vec![-1.0; layout::JOINTS], vec![1.0; layout::JOINTS])),
            &|file| drop(file.metadata.insert("joint_damping".into(), damping.clone())),
        ];
        for (i, change) in changes.into_iter().enumerate() {
            assert_ne!(of(change), own, "change {i}");
        }
    }
}
