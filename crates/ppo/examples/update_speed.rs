//! Prints what an update of the paper's locomotion setting costs:
//! `cargo run --release -p guidedog-ppo --example update_speed [environments]`.

use policy::{Mirror, StepBuffers, VecEnv};
use ppo::{Config, Trainer};

/// Environments that cost nothing.
struct Nothing(usize);

impl VecEnv for Nothing {
    fn num_envs(&self) -> usize {
        self.0
    }
    fn observation_dim(&self) -> usize {
        235
    }
    fn action_dim(&self) -> usize {
        12
    }
    fn observation_scale(&self) -> Vec<f32> {
        vec![1.0; 235]
    }
    fn mirror(&self) -> Option<Mirror> {
        None
    }
    fn reset(&mut self, observations: &mut [f32]) {
        for (i, value) in observations.iter_mut().enumerate() {
            *value = (i as f32 * 0.37).sin();
        }
    }
    fn step(&mut self, actions: &[f32], out: &mut StepBuffers) {
        self.reset(&mut out.observations);
        for (reward, action) in out.rewards.iter_mut().zip(actions.chunks(12)) {
            *reward = -action[0].abs();
        }
    }
    fn drain_metrics(&mut self) -> Vec<(String, f64)> {
        Vec::new()
    }
    fn save_state(&self, _out: &mut Vec<u8>) {}
    fn load_state(&mut self, _bytes: &[u8]) -> Result<(), String> {
        Ok(())
    }
}

fn main() {
    let envs = std::env::args().nth(1).map_or(4096, |text| text.parse().expect("a number of environments"));
    let config = Config::default();
    let minibatches = (config.epochs * config.minibatches) as f64;
    let rows = (envs * config.steps_per_env / config.minibatches) as f64;
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| {
            let mut trainer = Trainer::new(config.clone(), 1, Nothing(envs)).expect("a sound configuration");
            let mut best = [f64::INFINITY; 2];
            for _ in 0..3 {
                let [_, inference, update] = trainer.iterate().expect("an iteration").times_s;
                best = [best[0].min(inference), best[1].min(update)];
            }
            // Forward, gradient of weights and of inputs; the first layer needs no gradient of its input.
            let weights = |widths: &[usize]| widths.windows(2).map(|w| w[0] * w[1]).sum::<usize>();
            let all = weights(&[235, 512, 256, 128, 12]) + weights(&[235, 512, 256, 128, 1]);
            let flops = rows * (6 * all - 4 * 235 * 512) as f64;
            println!(
                "{threads} threads: {:.0} ms a minibatch of {rows} ({:.0} GFLOP/s), {:.0} ms of inference an iteration",
                best[1] / minibatches * 1e3,
                flops * minibatches / best[1] * 1e-9,
                best[0] * 1e3,
            );
        });
    }
}
