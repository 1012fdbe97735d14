//! Tasks a learner cannot fail at, and what must hold whatever the task: resuming, threads, refusals.

use policy::{Checkpoint, ForwardWorkspace, Mirror, StepBuffers, VecEnv};
use ppo::{Config, Precision, TrainError, Trainer};
use spatial::{Philox, Purpose};

/// What the toys have in common: a state an environment, a counter, and a rule.
#[derive(Clone)]
struct Toy {
    rule: Rule,
    states: Vec<[f32; 2]>,
    clocks: Vec<u32>,
    ticks: u32,
}

#[derive(Clone, Copy, PartialEq)]
enum Rule {
    /// Say what you see: reward −|a − o|².
    Echo,
    /// Keep an inverted pendulum (1 m, torque up to ±5 m/s² g-normalized) upright; it has fallen beyond 0.5 rad.
    Pendulum,
    /// Breaks at the third step.
    NotANumber,
}

const EPISODE: u32 = 100;

impl Toy {
    fn new(rule: Rule, num_envs: usize) -> Self {
        Self { rule, states: vec![[0.0; 2]; num_envs], clocks: vec![0; num_envs], ticks: 0 }
    }
    fn start(&mut self, env: usize) {
        let mut random = Philox::new(11, env, self.ticks, 0, Purpose::Reset);
        let width = if self.rule == Rule::Echo { 1.0 } else { 0.1 };
        self.states[env] = [random.uniform(-width, width), random.uniform(-width, width)];
        self.clocks[env] = 0;
    }
    fn advance(&mut self, env: usize, action: f32) -> (f32, bool) {
        let [angle, rate] = self.states[env];
        match self.rule {
            Rule::Echo => {
                let mut random = Philox::new(12, env, self.ticks, 0, Purpose::Command);
                self.states[env] = [random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)];
                (-(action - angle) * (action - angle), false)
            }
            Rule::Pendulum | Rule::NotANumber => {
                let rate = rate + 0.02 * (9.81 * angle.sin() + 5.0 * action.clamp(-1.0, 1.0));
                let angle = angle + 0.02 * rate;
                self.states[env] = [angle, rate];
                let broken = self.rule == Rule::NotANumber && self.ticks == 3;
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
    fn drain_metrics(&mut self) -> Vec<(String, f64)> {
        Vec::new()
    }
    fn save_state(&self, out: &mut Vec<u8>) {
        out.extend(self.ticks.to_le_bytes());
        for (state, clock) in self.states.iter().zip(&self.clocks) {
            out.extend(state[0].to_le_bytes());
            out.extend(state[1].to_le_bytes());
            out.extend(clock.to_le_bytes());
        }
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

fn config() -> Config {
    Config { actor_hidden: vec![32, 32], critic_hidden: vec![32, 32], ..Config::default() }
}

fn trainer(rule: Rule) -> Trainer<Toy> {
    Trainer::new(config(), 3, Toy::new(rule, 64)).unwrap()
}

#[test]
fn learns_to_say_what_it_sees() {
    let mut trainer = trainer(Rule::Echo);
    for _ in 0..80 {
        trainer.iterate().unwrap();
    }
    let policy = trainer.policy();
    for seen in [-0.8, -0.2, 0.5, 0.9] {
        let mut said = [0.0];
        policy.forward(1, &[seen, 0.3], &mut said, &mut ForwardWorkspace::default());
        assert!((said[0] - seen).abs() < 0.15, "sees {seen}, says {}", said[0]);
    }
}

#[test]
fn learns_to_balance_with_and_without_its_mirror_image() {
    for symmetry in [false, true] {
        let config = Config { symmetry, ..config() };
        let mut trainer = Trainer::new(config, 3, Toy::new(Rule::Pendulum, 64)).unwrap();
        let first = trainer.iterate().unwrap();
        let mut last = first.clone();
        for _ in 0..60 {
            last = trainer.iterate().unwrap();
        }
        assert!(first.episode_length < 60.0, "a beginner falls: {}", first.episode_length);
        assert!(last.episode_length > 95.0, "symmetry {symmetry}: mean episode {}", last.episode_length);
    }
}

/// Everything after `iterations`, stopping and resuming from bytes after `interrupt`.
fn weights(iterations: usize, interrupt: Option<usize>) -> Checkpoint {
    let mut trainer = trainer(Rule::Pendulum);
    for i in 0..iterations {
        if interrupt == Some(i) {
            let bytes = trainer.checkpoint().to_bytes();
            trainer = self::trainer(Rule::Pendulum);
            trainer.restore(&Checkpoint::from_bytes(&bytes).unwrap()).unwrap();
        }
        trainer.iterate().unwrap();
    }
    trainer.checkpoint()
}

#[test]
fn a_resumed_run_gives_the_same_bits() {
    let whole = weights(6, None);
    for interrupt in [1, 3, 5] {
        assert!(weights(6, Some(interrupt)) == whole, "interrupted after {interrupt}");
    }
}

/// Precisions of this processor.
fn precisions() -> Vec<Precision> {
    let all = [Precision::F32, Precision::Bf16];
    all.into_iter()
        .filter(|p| {
            p.available() || {
                eprintln!("skipped: no {p:?} here");
                false
            }
        })
        .collect()
}

#[test]
fn threads_do_not_change_a_bit() {
    for precision in precisions() {
        let config = Config { precision, ..config() };
        // Minibatches of twelve tiles, so that every thread has work.
        let weights = || {
            let mut trainer = Trainer::new(config.clone(), 3, Toy::new(Rule::Pendulum, 512)).unwrap();
            (0..3).for_each(|_| drop(trainer.iterate().unwrap()));
            trainer.checkpoint()
        };
        let runs = [1, 2, 7].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(weights)
        });
        assert!(runs[0] == runs[1] && runs[0] == runs[2], "{precision:?}");
    }
}

#[test]
fn every_precision_begins_with_ratios_of_one() {
    for precision in precisions() {
        let config = Config { precision, epochs: 1, minibatches: 1, ..config() };
        let mut trainer = Trainer::new(config, 3, Toy::new(Rule::Echo, 64)).unwrap();
        let first = trainer.iterate().unwrap();
        // The rollout's log-probabilities are of the same precision as the update's.
        assert!(first.clip_fraction == 0.0 && first.kl.abs() < 1e-6, "{precision:?}: {first:?}");
    }
}

#[test]
fn what_is_not_a_number_stops_the_run_by_name() {
    let mut trainer = trainer(Rule::NotANumber);
    let before = trainer.policy();
    let error = trainer.iterate().unwrap_err();
    assert!(matches!(error, TrainError::NonFinite { what: "a reward", iteration: 0 }), "{error}");
    assert_eq!(trainer.policy(), before);
}

#[test]
fn checkpoints_that_do_not_fit_are_refused() {
    let checkpoint = trainer(Rule::Pendulum).checkpoint();
    let wider = Config { actor_hidden: vec![33, 32], ..config() };
    let mut other = Trainer::new(wider, 3, Toy::new(Rule::Pendulum, 64)).unwrap();
    assert!(other.restore(&checkpoint).unwrap_err().to_string().contains("parameters"));
    let mut other = Trainer::new(config(), 4, Toy::new(Rule::Pendulum, 64)).unwrap();
    assert!(other.restore(&checkpoint).unwrap_err().to_string().contains("seed is 3"));
    let mut other = Trainer::new(config(), 3, Toy::new(Rule::Pendulum, 32)).unwrap();
    assert!(other.restore(&checkpoint).is_err());
}
