//! What one update of the paper's locomotion setting costs; `benches/README.md` says how to run and read it.

mod nothing;
#[path = "../shared/peak.rs"]
mod peak;

use std::io::BufRead as _;
use std::time::Instant;

use evaluation::statistics;
use guidedog::config::resolve;
use guidedog::learner::Trainable as _;
use guidedog::machine::{processor_s, resident_mb};
use guidedog::ppo::{Config, Precision, Trainer};
use guidedog::run_config::LocomotionRun;
use nothing::Nothing;

const HELP: &str = "cargo bench --bench learning -- [OPTIONS]
  --precision f32|bf16  what products are made of [both, where the processor has AVX-512 BF16]
  --threads N           threads [1]
  --samples N           samples of an update, a multiple of 24 [98304]
  --rounds N            updates that are timed [3]
  --whole               whole iterations of configs/locomotion/paper.toml, robots and ground included: time and memory
  --follow              one update for each line of standard input, one JSON object each (for compare.py)";

#[derive(Clone)]
struct Options {
    precisions: Vec<Precision>,
    threads: usize,
    samples: usize,
    rounds: usize,
    whole: bool,
    follow: bool,
}

/// One update.
struct Update {
    seconds: f64,
    /// Of all threads; what other programs take is not in it.
    cpu_seconds: f64,
    inference_seconds: f64,
}

fn main() {
    let options = match parse(std::env::args().skip(1)) {
        Ok(Some(options)) => options,
        Ok(None) => return println!("{HELP}"),
        Err(message) => {
            eprintln!("{message}\n{HELP}");
            std::process::exit(2);
        }
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(options.threads).build().expect("threads");
    pool.install(|| {
        if options.follow {
            follow(&options);
        } else if options.whole {
            whole(&options);
        } else {
            table(&options);
        }
    });
}

fn learner(options: &Options, precision: Precision) -> Trainer<Nothing> {
    let config = Config { precision, ..Config::default() };
    let envs = options.samples / config.steps_per_env;
    let mut trainer = Trainer::new(config, 1, Nothing(envs)).expect("a sound configuration");
    update(&mut trainer);
    trainer
}

fn update(trainer: &mut Trainer<Nothing>) -> Update {
    let before = processor_s();
    let start = Instant::now();
    let [simulation, inference_seconds, seconds] = trainer.iterate().expect("an iteration").times_s;
    // Outside the update the threads do nothing that counts but inference, so their processor time is divided in proportion.
    let share = seconds / start.elapsed().as_secs_f64().max(simulation + inference_seconds + seconds);
    Update { seconds, cpu_seconds: (processor_s() - before) * share, inference_seconds }
}

/// The paper's training as it is, robots and all.
fn whole(options: &Options) {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/locomotion/paper.toml");
    let config: LocomotionRun = resolve(Some(&path), &[]).expect("a sound configuration");
    println!(
        "{} robots x {} steps, {} threads",
        config.training.num_envs, config.ppo.steps_per_env, options.threads
    );
    println!("resident memory is the most this process ever had; for that of one precision, --precision");
    for &precision in &options.precisions {
        let env = config.task.environments(config.training.num_envs, 1).expect("a sound configuration");
        let ppo = Config { precision, ..config.ppo.clone() };
        let mut trainer = Trainer::new(ppo, 1, env).expect("a sound configuration");
        for _ in 0..options.rounds {
            let [simulation, inference, update] = trainer.iterate().expect("an iteration").times_s;
            println!(
                "{precision:?}: simulation {simulation:.2} s, inference {inference:.2} s, update {update:.2} s; resident at most {:.0} MB (goal: 1500)",
                resident_mb()
            );
        }
        let saved = trainer.checkpoint().to_bytes().len() as f64 / 1e6;
        println!("{precision:?}: a checkpoint of {saved:.0} MB; resident at most {:.0} MB", resident_mb());
    }
}

fn table(options: &Options) {
    let peak = peak::fused_multiply_adds();
    let count = Config::default().update_operations(235, 12) * options.samples as f64;
    let (samples, threads) = (options.samples, options.threads);
    println!("{samples} samples, {:.0} GFLOP needed an update, {threads} threads", count / 1e9);
    println!("fused multiply-add peak of one core, f32: {:.0} GFLOP/s", peak / 1e9);
    println!("times are medians; rate and share of the f32 peak: of a thread, by processor time");
    println!(
        "{:<6} {:>10} {:>12} {:>10} {:>9} {:>15}",
        "", "update s", "processor s", "GFLOP/s", "of peak", "inference s"
    );
    let mut learners: Vec<_> =
        options.precisions.iter().map(|&precision| (precision, learner(options, precision))).collect();
    let mut times: Vec<Vec<Update>> = learners.iter().map(|_| Vec::new()).collect();
    for _ in 0..options.rounds {
        for ((_, learner), times) in learners.iter_mut().zip(&mut times) {
            times.push(update(learner));
        }
    }
    for ((precision, _), times) in learners.iter().zip(&times) {
        let seconds = median(times, |update| update.seconds);
        let cpu = median(times, |update| update.cpu_seconds);
        let rate = count / cpu;
        println!(
            "{:<6} {seconds:>10.2} {cpu:>12.2} {:>10.0} {:>8.0}% {:>15.2}",
            format!("{precision:?}").to_lowercase(),
            rate / 1e9,
            100.0 * rate / peak,
            median(times, |update| update.inference_seconds),
        );
    }
    println!("resident memory at most: {:.0} MB", resident_mb());
}

fn median(updates: &[Update], of: impl Fn(&Update) -> f64) -> f64 {
    let values: Vec<f64> = updates.iter().map(of).collect();
    statistics::median(&values).expect("at least one round")
}

fn follow(options: &Options) {
    let mut learner = learner(options, options.precisions[0]);
    for line in std::io::stdin().lock().lines() {
        if line.is_err() {
            return;
        }
        let Update { seconds, cpu_seconds, .. } = update(&mut learner);
        let resident = resident_mb();
        println!(r#"{{"s": {seconds}, "cpu_s": {cpu_seconds}, "resident_mb": {resident}}}"#);
    }
}

fn parse(mut words: impl Iterator<Item = String>) -> Result<Option<Options>, String> {
    let accelerated: Vec<Precision> = [Precision::F32, Precision::Bf16]
        .into_iter()
        .filter(|precision| precision.is_accelerated())
        .collect();
    let mut options = Options {
        precisions: accelerated.clone(),
        threads: 1,
        samples: 98_304,
        rounds: 3,
        whole: false,
        follow: false,
    };
    while let Some(word) = words.next() {
        let mut value = || words.next().ok_or(format!("{word} needs a value"));
        let number = |text: String| text.parse().map_err(|_| format!("{word} is {text}, must be a number"));
        match word.as_str() {
            "--precision" => {
                let name = value()?;
                let named = |p: &Precision| format!("{p:?}").to_lowercase() == name;
                let found = accelerated.iter().copied().find(named);
                options.precisions =
                    vec![found.ok_or(format!("{name}: this processor has {accelerated:?}"))?];
            }
            "--threads" => options.threads = number(value()?)?,
            "--samples" => options.samples = number(value()?)?,
            "--rounds" => options.rounds = number(value()?)?.max(1),
            "--whole" => options.whole = true,
            "--follow" => options.follow = true,
            "--bench" => {} // cargo adds it
            "--help" => return Ok(None),
            _ => return Err(format!("{word} is no option")),
        }
    }
    if options.samples == 0 || !options.samples.is_multiple_of(24) {
        return Err(format!("--samples is {}, must be a multiple of 24 above 0", options.samples));
    }
    Ok(Some(options))
}
