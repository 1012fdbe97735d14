//! Several ranks, as threads of this process, learn what one with all their environments learns: the same bits.

mod toy;

use policy::{Checkpoint, Share};
use ppo::{Config, Iteration, Precision, SymmetryBy, TrainError, Trainer, exchange::threads};
use toy::{Rule, Toy, config};

const ENVS: usize = 512;

/// What `work` gives on each rank, its toys not equally many.
fn on_ranks<T: Send>(
    config: &Config,
    rule: Rule,
    ranks: usize,
    work: impl Fn(Trainer<Toy>) -> T + Sync,
) -> Vec<T> {
    let work = &work;
    std::thread::scope(|scope| {
        let start = |(rank, exchange)| {
            scope.spawn(move || {
                let share = Share::of_rank(rank, ranks, ENVS, 32).unwrap();
                let toys = Toy::with_share(rule, share.envs);
                work(Trainer::with_ranks(config.clone(), 3, toys, Box::new(exchange)).unwrap())
            })
        };
        let running: Vec<_> = threads(ranks).into_iter().enumerate().map(start).collect();
        running.into_iter().map(|thread| thread.join().unwrap()).collect()
    })
}

/// Trains for some iterations, from a checkpoint if there is one.
fn train(mut trainer: Trainer<Toy>, from: Option<&Checkpoint>, iterations: u64) -> (Checkpoint, Iteration) {
    if let Some(checkpoint) = from {
        trainer.restore(checkpoint).unwrap();
    }
    let mut last = None;
    for _ in 0..iterations {
        last = Some(trainer.iterate().unwrap());
    }
    (trainer.checkpoint(), last.unwrap())
}

/// What an iteration showed but for what it cost.
fn shown(iteration: &Iteration) -> Iteration {
    Iteration { times_s: [0.0; 3], exchange_s: 0.0, exchange_bytes: 0, ..iteration.clone() }
}

fn learns_the_same(config: &Config, ranks: &[usize]) {
    let run = |ranks: usize| {
        on_ranks(config, Rule::Pendulum, ranks, |trainer| train(trainer, None, 3)).swap_remove(0)
    };
    let (alone, iteration) = run(1);
    for &ranks in ranks {
        let (checkpoint, of_ranks) = run(ranks);
        assert!(checkpoint == alone, "{ranks} ranks: the checkpoint differs");
        assert_eq!(shown(&of_ranks), shown(&iteration), "{ranks} ranks");
        assert!(of_ranks.exchange_bytes > 0 && iteration.exchange_bytes == 0);
    }
}

#[test]
fn any_number_of_ranks_gives_the_checkpoint_of_one() {
    learns_the_same(&config(), &[2, 3, 8]);
}

#[test]
fn also_with_mirror_images_quiet_environments_more_blocks_and_samples_left_over() {
    // 12 288 samples in 7 minibatches: three are left over.
    let config = Config {
        symmetry: SymmetryBy::Samples,
        kinks_at_observations: true,
        quiet_share: 0.3,
        gradient_blocks: 3,
        minibatches: 7,
        ..config()
    };
    learns_the_same(&config, &[2, 3, 5]);
}

#[test]
fn also_in_bf16() {
    learns_the_same(&Config { precision: Precision::Bf16, ..config() }, &[2, 3]);
}

#[test]
fn a_run_goes_on_with_another_number_of_ranks() {
    let config = config();
    let run = |ranks: usize, from: Option<&Checkpoint>, iterations| {
        on_ranks(&config, Rule::Pendulum, ranks, |trainer| train(trainer, from, iterations)).swap_remove(0).0
    };
    let expected = run(1, None, 4);
    let mut checkpoint = run(3, None, 1);
    for ranks in [1, 2, 3] {
        checkpoint = run(ranks, Some(&checkpoint), 1);
    }
    assert!(checkpoint == expected);
}

#[test]
fn what_is_not_a_number_on_one_rank_ends_all() {
    let config = config();
    let errors = on_ranks(&config, Rule::NotANumber, 3, |mut trainer| trainer.iterate().unwrap_err());
    assert!(matches!(errors[0], TrainError::NonFinite { what: "a reward", iteration: 0 }));
    for error in &errors[1..] {
        assert_eq!(error.to_string(), "rank 0: a reward is not finite in iteration 0");
    }
}

#[test]
fn more_ranks_than_partial_gradients_are_refused_with_what_would_do() {
    let refusals = std::thread::scope(|scope| {
        let start = |exchange| {
            scope.spawn(|| {
                let toys = Toy::new(Rule::Echo, 4);
                Trainer::with_ranks(config(), 3, toys, Box::new(exchange)).err().unwrap().to_string()
            })
        };
        let running: Vec<_> = threads(9).into_iter().map(start).collect();
        running.into_iter().map(|thread| thread.join().unwrap()).collect::<Vec<_>>()
    });
    assert_eq!(refusals[0], "gradient_blocks is 1, must be at least 2 for 9 ranks (9 is best)");
}
