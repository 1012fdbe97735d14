//! Small environments to learn in.

use std::ops::Range;

use policy::{Mirror, StepBuffers, VecEnv};
use ppo::Config;
use spatial::{Philox, Purpose};

/// What the toys have in common: a state an environment, a counter, and a rule.
#[derive(Clone)]
pub(crate) struct Toy {
    rule: Rule,
    /// Number of the first toy among those of all ranks.
    first: usize,
    states: Vec<[f32; 2]>,
    clocks: Vec<u32>,
    ticks: u32,
}

#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Rule {
    /// Say what you see: reward −|a − o|².
    Echo,
    /// Keep an inverted pendulum (1 m, torque up to ±5 m/s² g-normalized) upright; it has fallen beyond 0.5 rad.
    Pendulum,
    /// Breaks at the third step, of the toy with number 0.
    NotANumber,
}

const EPISODE: u32 = 100;

impl Toy {
    pub(crate) fn new(rule: Rule, num_envs: usize) -> Self {
        Self::with_share(rule, 0..num_envs)
    }
    /// Some of the toys of all ranks.
    pub(crate) fn with_share(rule: Rule, envs: Range<usize>) -> Self {
        let (first, number) = (envs.start, envs.len());
        Self { rule, first, states: vec![[0.0; 2]; number], clocks: vec![0; number], ticks: 0 }
    }
    fn start(&mut self, env: usize) {
        let mut random = Philox::new(11, self.first + env, self.ticks, 0, Purpose::Reset);
        let width = if self.rule == Rule::Echo { 1.0 } else { 0.1 };
        self.states[env] = [random.uniform(-width, width), random.uniform(-width, width)];
        self.clocks[env] = 0;
    }
    fn advance(&mut self, env: usize, action: f32) -> (f32, bool) {
        let [angle, rate] = self.states[env];
        match self.rule {
            Rule::Echo => {
                let mut random = Philox::new(12, self.first + env, self.ticks, 0, Purpose::Command);
                self.states[env] = [random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)];
                (-(action - angle) * (action - angle), false)
            }
            Rule::Pendulum | Rule::NotANumber => {
                let rate = rate + 0.02 * (9.81 * angle.sin() + 5.0 * action.clamp(-1.0, 1.0));
                let angle = angle + 0.02 * rate;
                self.states[env] = [angle, rate];
                let broken = self.rule == Rule::NotANumber && self.ticks == 3 && self.first + env == 0;
                (if broken { f32::NAN } else { 1.0 }, angle.abs() > 0.5)
            }
        }
    }
}

impl VecEnv for Toy {
    fn num_envs(&self) -> usize {
        self.states.len()
    }
    fn observation_dim(&self) -> usize {
        2
    }
    fn action_dim(&self) -> usize {
        1
    }
    fn observation_scale(&self) -> Vec<f32> {
        vec![1.0, 0.5]
    }
    fn mirror(&self) -> Option<Mirror> {
        Some(Mirror { observation: vec![(0, -1.0), (1, -1.0)], action: vec![(0, -1.0)] })
    }
    fn reset(&mut self, observations: &mut [f32]) {
        for env in 0..self.states.len() {
            self.start(env);
            observations[2 * env..2 * env + 2].copy_from_slice(&self.states[env]);
        }
    }
    fn step(&mut self, actions: &[f32], out: &mut StepBuffers) {
        self.ticks += 1;
        for env in 0..self.states.len() {
            let (reward, fell) = self.advance(env, actions[env]);
            self.clocks[env] += 1;
            out.rewards[env] = reward;
            out.terminated[env] = fell;
            out.truncated[env] = !fell && self.clocks[env] >= EPISODE;
            if fell || out.truncated[env] {
                out.last_observations[2 * env..2 * env + 2].copy_from_slice(&self.states[env]);
                self.start(env);
            }
            out.observations[2 * env..2 * env + 2].copy_from_slice(&self.states[env]);
        }
    }
    fn save_state(&self, out: &mut Vec<u8>) {
        out.extend(self.ticks.to_le_bytes());
        for (state, clock) in self.states.iter().zip(&self.clocks) {
            out.extend(state[0].to_le_bytes());
            out.extend(state[1].to_le_bytes());
            out.extend(clock.to_le_bytes());
        }
    }
    fn common_state_len(&self) -> usize {
        size_of_val(&self.ticks)
    }
    fn take_sums(&mut self) -> Vec<f64> {
        self.clocks.iter().map(|&clock| f64::from(clock)).collect()
    }
    fn report(&mut self, sums: &[f64]) -> Vec<(String, f64)> {
        vec![("clock".into(), sums.iter().sum::<f64>() / sums.len() as f64)]
    }
    fn load_state(&mut self, bytes: &[u8]) -> Result<(), String> {
        if bytes.len() != 4 + 12 * self.states.len() {
            return Err(format!("{} bytes for {} toys", bytes.len(), self.states.len()));
        }
        let word = |i: usize| [0, 1, 2, 3].map(|b| bytes[4 * i + b]);
        self.ticks = u32::from_le_bytes(word(0));
        for env in 0..self.states.len() {
            self.states[env] = [f32::from_le_bytes(word(3 * env + 1)), f32::from_le_bytes(word(3 * env + 2))];
            self.clocks[env] = u32::from_le_bytes(word(3 * env + 3));
        }
        Ok(())
    }
}

/// Settings with small networks.
pub(crate) fn config() -> Config {
    Config { actor_hidden: vec![32, 32], critic_hidden: vec![32, 32], ..Config::default() }
}
