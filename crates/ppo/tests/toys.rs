//! Tasks a learner cannot fail at, and what must hold whatever the task: resuming, threads, refusals.

mod toy;

use policy::{Checkpoint, ForwardWorkspace, Linear, VecEnv as _};
use ppo::{Config, Precision, SymmetryBy, TrainError, Trainer};
use toy::{Rule, Toy, config};

fn trainer(rule: Rule) -> Trainer<Toy> {
    Trainer::new(config(), 3, Toy::new(rule, 64)).unwrap()
}

#[test]
fn learns_to_say_what_it_sees() {
    for quiet_share in [0.0, 0.4] {
        let config = Config { quiet_share, ..config() };
        let mut trainer = Trainer::new(config, 3, Toy::new(Rule::Echo, 64)).unwrap();
        for _ in 0..80 {
            trainer.iterate().unwrap();
        }
        let policy = trainer.policy();
        for seen in [-0.8, -0.2, 0.5, 0.9] {
            let mut said = [0.0];
            policy.forward(1, &[seen, 0.3], &mut said, &mut ForwardWorkspace::default());
            assert!((said[0] - seen).abs() < 0.15, "sees {seen}, says {}, quiet: {quiet_share}", said[0]);
        }
    }
}

#[test]
fn quiet_environments_act_without_noise() {
    let loss = |quiet_share| {
        let config = Config { quiet_share, ..config() };
        let mut trainer = Trainer::new(config, 3, Toy::new(Rule::Echo, 512)).unwrap();
        -trainer.iterate().unwrap().step_reward
    };
    // Of the squared error a variance of 1 is noise's.
    let spared = loss(0.0) - loss(0.6);
    assert!((spared - 0.6).abs() < 0.1, "{spared}");
}

#[test]
fn learns_to_balance_with_and_without_its_mirror_image() {
    for symmetry in [SymmetryBy::None, SymmetryBy::Samples, SymmetryBy::Networks] {
        let config = Config { symmetry, ..config() };
        let mut trainer = Trainer::new(config, 3, Toy::new(Rule::Pendulum, 64)).unwrap();
        let first = trainer.iterate().unwrap();
        let mut last = first.clone();
        for _ in 0..60 {
            last = trainer.iterate().unwrap();
        }
        assert!(first.episode_length < 60.0, "a beginner falls: {}", first.episode_length);
        assert!(last.episode_length > 95.0, "{symmetry:?}: mean episode {}", last.episode_length);
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

const PRECISIONS: [Precision; 2] = [Precision::F32, Precision::Bf16];

#[test]
fn threads_do_not_change_a_bit() {
    for precision in PRECISIONS {
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
    for precision in PRECISIONS {
        let config = Config { precision, epochs: 1, minibatches: 1, ..config() };
        let mut trainer = Trainer::new(config, 3, Toy::new(Rule::Echo, 64)).unwrap();
        let first = trainer.iterate().unwrap();
        // The rollout's log-probabilities are of the same precision as the update's.
        assert!(first.clip_fraction == 0.0 && first.kl.abs() < 1e-6, "{precision:?}: {first:?}");
    }
}

#[test]
fn every_unit_has_its_kink_at_one_of_the_first_observations() {
    let mut toy = Toy::new(Rule::Echo, 64);
    let mut seen = vec![0.0; 64 * toy.observation_dim()];
    toy.reset(&mut seen);
    let config = Config { kinks_at_observations: true, ..config() };
    let policy = Trainer::new(config, 3, Toy::new(Rule::Echo, 64)).unwrap().policy();
    let Linear { inputs, outputs, weight, bias } = &policy.layers[0];
    for unit in 0..*outputs {
        let row = &seen[unit * 64 / outputs * inputs..][..*inputs];
        let products = row.iter().zip(&weight[unit * inputs..]).map(|(x, w)| x * w);
        let sum = bias[unit] + products.sum::<f32>();
        assert!(sum.abs() < 1e-6, "unit {unit}: {sum}");
    }
}

#[test]
fn a_small_last_layer_begins_with_small_mean_actions() {
    let policy = |initial_output_scale| {
        Trainer::new(Config { initial_output_scale, ..config() }, 3, Toy::new(Rule::Echo, 64))
            .unwrap()
            .policy()
    };
    let [usual, small] = [1.0, 0.01].map(policy);
    let (usual_last, small_last) = (usual.layers.last().unwrap(), small.layers.last().unwrap());
    assert!(usual_last.weight.iter().any(|weight| weight.abs() > 0.1));
    for (usual, small) in [(&usual_last.weight, &small_last.weight), (&usual_last.bias, &small_last.bias)] {
        assert!(usual.iter().zip(small).all(|(usual, small)| (0.01 * usual - small).abs() < 1e-6));
    }
    assert_eq!(usual.layers[0], small.layers[0]);
}

/// A step of the optimizer follows the cut, so the noise may be a little above it at the end of an iteration.
#[test]
fn noise_is_cut_off_in_the_middle_of_a_training() {
    let mut trainer = trainer(Rule::Echo);
    assert!(trainer.iterate().unwrap().action_std > 0.5);
    let taught = trainer.checkpoint();
    let config = Config { max_std: 0.2, ..config() };
    let mut careful = Trainer::new(config, 3, Toy::new(Rule::Echo, 64)).unwrap();
    careful.warm_start(&taught).unwrap();
    let first = careful.iterate().unwrap();
    assert!((0.1..0.25).contains(&first.action_std), "{}", first.action_std);
    let actions = &careful.distributions()[3];
    assert_eq!(actions.0, "rollout/actions");
    let rows = actions.1.len() as f32;
    let spread = (actions.1.iter().map(|action| action * action).sum::<f32>() / rows).sqrt();
    assert!(spread < 0.4, "{spread}");
}

#[test]
fn at_first_only_the_critic_learns_if_one_wants_that() {
    let config = Config { critic_iterations: 2, ..config() };
    let mut trainer = Trainer::new(config, 3, Toy::new(Rule::Pendulum, 64)).unwrap();
    let before = trainer.policy();
    let critic = |trainer: &Trainer<Toy>| trainer.distributions().swap_remove(1).1;
    let untaught = critic(&trainer);
    let first = trainer.iterate().unwrap();
    let second = trainer.iterate().unwrap();
    assert_eq!(trainer.policy(), before);
    assert_eq!((first.kl, first.action_std), (0.0, second.action_std));
    assert!(critic(&trainer) != untaught && second.value_loss < first.value_loss);
    trainer.iterate().unwrap();
    assert!(trainer.policy() != before);
}

#[test]
fn what_is_not_a_number_stops_the_run_by_name() {
    let mut trainer = trainer(Rule::NotANumber);
    let before = trainer.policy();
    let error = trainer.iterate().unwrap_err();
    assert!(matches!(error, TrainError::NonFinite { what: "a reward", iteration: 0 }), "{error}");
    assert_eq!(trainer.policy(), before);
}

/// Of the first unit of the actor: ELU makes 0 of NaN, so no loss shows it.
#[test]
fn a_weight_that_is_not_a_number_is_noticed_although_no_loss_shows_it() {
    let mut checkpoint = trainer(Rule::Echo).checkpoint();
    checkpoint.tensors.get_mut("adam/first_moment").unwrap().1[0] = f32::NAN;
    let mut spoilt = trainer(Rule::Echo);
    spoilt.restore(&checkpoint).unwrap();
    let error = spoilt.iterate().unwrap_err();
    assert!(matches!(error, TrainError::NonFinite { what: "a parameter", iteration: 0 }), "{error}");
    checkpoint.tensors.get_mut("parameters").unwrap().1[0] = f32::NAN;
    let refusals = [trainer(Rule::Echo).restore(&checkpoint), trainer(Rule::Echo).warm_start(&checkpoint)];
    for refusal in refusals {
        assert_eq!(refusal.unwrap_err().to_string(), "parameter 0 is NaN, must be finite");
    }
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

#[test]
fn weights_of_observations_scaled_otherwise_are_refused() {
    let mut checkpoint = trainer(Rule::Echo).checkpoint();
    checkpoint.tensors.get_mut("observation_scale").unwrap().1[1] = 2.0;
    let message = trainer(Rule::Echo).warm_start(&checkpoint).unwrap_err().to_string();
    assert!(message.starts_with("observation 1 was scaled by 2, must be by 0.5"), "{message}");
    // Those of before do not say it.
    checkpoint.tensors.remove("observation_scale");
    trainer(Rule::Echo).warm_start(&checkpoint).unwrap();
}
