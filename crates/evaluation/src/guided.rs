//! A squad of robots under a supervisor and scripted hands.

use policy::{ForwardWorkspace, layout};
use spatial::{Philox, Purpose};
use tasks::guidance::{Course, Squad, Supervisor, sensed_force};

use crate::setting::Setting;

/// Robots, the forces on them and the commands they are given.
pub(crate) struct Guided<'a> {
    pub(crate) course: &'a Course,
    pub(crate) supervisor: &'a Supervisor,
    pub(crate) squad: Squad,
    setting: &'a Setting,
    step: u32,
    forces: Vec<[[f32; 3]; 2]>,
    commands: Vec<[f32; 3]>,
    fallen: Vec<bool>,
    observations: Vec<f32>,
    workspace: ForwardWorkspace,
}

impl<'a> Guided<'a> {
    /// Robots that were reset, no hand on the bar yet.
    pub(crate) fn new(
        course: &'a Course,
        supervisor: &'a Supervisor,
        squad: Squad,
        setting: &'a Setting,
    ) -> Self {
        let robots = squad.robots();
        let observed = if supervisor.observes() { robots * layout::SUPERVISOR_OBSERVATION } else { 0 };
        Self {
            course,
            supervisor,
            squad,
            setting,
            step: 0,
            forces: vec![[[0.0; 3]; 2]; robots],
            commands: vec![[0.0; 3]; robots],
            fallen: vec![false; robots],
            observations: vec![0.0; observed],
            workspace: ForwardWorkspace::default(),
        }
    }

    /// The hand pulls with this force from now on, heading frame \[N\]; on the supervisor's sensor alone where robots are unloaded.
    pub(crate) fn pull(&mut self, robot: usize, force: [f32; 3]) {
        self.forces[robot] = [force; 2];
        if !self.setting.unloaded {
            self.squad.set_hand_force(robot, force);
        }
    }

    /// The command a robot obeys, and the force on it.
    pub(crate) fn told(&self, robot: usize) -> ([f32; 3], [f32; 3]) {
        (self.commands[robot], self.forces[robot][1])
    }

    /// Whether a robot has fallen since the beginning.
    pub(crate) fn has_fallen(&self, robot: usize) -> bool {
        self.fallen[robot]
    }

    /// One control step, with a decision of the supervisor where one is due.
    pub(crate) fn control_step(&mut self) {
        if self.step.is_multiple_of(self.supervisor.period_steps()) {
            self.decide();
        }
        let step = self.step;
        self.squad.control_step(self.course, &self.commands, |_| (0, step));
        self.step += 1;
        for robot in 0..self.fallen.len() {
            self.fallen[robot] |= self.squad.has_fallen(robot);
        }
    }

    fn decide(&mut self) {
        let Self { course, squad, forces, commands, observations, workspace, step, .. } = self;
        let noise = self.setting.force_noise_n as f32;
        if noise > 0.0 {
            for (robot, [seen, real]) in forces.iter_mut().enumerate() {
                let number = squad.first_robot + robot;
                let mut random = Philox::new(course.seed, number, 0, *step, Purpose::ForceObservation);
                *seen = sensed_force(*real, [noise; 3], &mut random);
            }
        }
        for (robot, row) in observations.chunks_exact_mut(layout::SUPERVISOR_OBSERVATION).enumerate() {
            let number = squad.first_robot + robot;
            let mut random = Philox::new(course.seed, number, 0, *step, Purpose::SupervisorObservation);
            squad.sense(course, robot, forces[robot][0], commands[robot], &mut random, row);
        }
        self.supervisor.decide(observations, forces, workspace, commands);
    }
}
