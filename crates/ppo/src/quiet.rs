//! Environments that keep quiet: for some iterations they act on the policy's mean, without noise. What a policy does without noise can
//! lead where noise never lets it stay, such as to a gait that comes to rest against a riser; whoever is judged without noise has to have
//! been there. Quiet samples teach the critic, and the policy no more than to be smooth: an action without noise says nothing about
//! another. The policy learns its way out from the noise that sets in afterwards.

use spatial::{Philox, Purpose};

/// Iterations in a row; of an environment's neighbors each begins an iteration later.
const ITERATIONS: u64 = 4;

/// Whether an environment, by its number among those of all ranks, keeps quiet in an iteration; `share` of them do.
pub(crate) fn keeps_quiet(share: f32, seed: u64, env: usize, iteration: u64) -> bool {
    let stretch = (iteration + env as u64) / ITERATIONS;
    share > 0.0 && Philox::new(seed, env, stretch as u32, 0, Purpose::Quiet).uniform01() < share
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_share_keeps_quiet_for_four_iterations_at_a_time() {
        let quiet = |env: usize, iteration: u64| keeps_quiet(0.3, 1, env, iteration);
        let number = (0..4000).filter(|&env| quiet(env, 7)).count();
        assert!((1100..1300).contains(&number), "{number}");
        for env in 0..100 {
            let changes: Vec<u64> = (1..200).filter(|&i| quiet(env, i) != quiet(env, i - 1)).collect();
            assert!(changes.len() > 5 && changes.iter().all(|i| (i + env as u64).is_multiple_of(ITERATIONS)));
        }
        assert!((0..100).all(|env| !keeps_quiet(0.0, 1, env, 0)));
    }
}
