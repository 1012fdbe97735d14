//! What a physics step of one robot costs, scene by scene; `benches/README.md` says how to run and read it.

mod counted;
#[path = "../shared/peak.rs"]
mod peak;
mod scene;

use std::time::{Duration, Instant};

use counted::Operations;
use evaluation::statistics::median;
use scene::{Herd, SCENES, Scene};

/// What the command line asks for.
struct Options {
    scene: Option<String>,
    robots: usize,
    threads: usize,
    seconds: f64,
    json: bool,
    count: bool,
}

const HELP: &str = "cargo bench --bench physics -- [OPTIONS]
  --scene NAME    only this scene
  --robots N      robots, a multiple of 16 [1024]
  --threads N     threads [1]
  --seconds S     time spent on each scene [3]
  --count         also count the floating-point operations of a step
  --json          one JSON object a line instead of a table";

fn main() {
    let options = match parse(std::env::args().skip(1)) {
        Ok(Some(options)) => options,
        Ok(None) => return println!("{HELP}"),
        Err(message) => {
            eprintln!("{message}\n{HELP}");
            std::process::exit(2);
        }
    };
    let peak = peak::fused_multiply_adds();
    if !options.json {
        println!("fused multiply-add peak of one core: {:.0} GFLOP/s", peak / 1e9);
        println!(
            "{:<14} {:>16} {:>16} {:>12} {:>10}",
            "scene", "µs median", "µs fastest", "operations", "of peak"
        );
    }
    for scene in SCENES.iter().filter(|scene| options.scene.as_deref().is_none_or(|name| name == scene.name))
    {
        let times = measure(scene, &options);
        let median = median(&times).expect("at least three passes");
        let fastest = times.iter().copied().fold(f64::INFINITY, f64::min);
        let operations = options.count.then(|| scene::operations(scene));
        report(scene, median, fastest, operations, peak, &options);
    }
}

/// Microseconds of one physics step of one robot, a value a pass of two simulated seconds.
fn measure(scene: &Scene, options: &Options) -> Vec<f64> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(options.threads).build().expect("threads");
    let mut herd = Herd::new(scene, options.robots);
    let end = Instant::now() + Duration::from_secs_f64(options.seconds);
    let mut times = Vec::new();
    while times.len() < 3 || Instant::now() < end {
        herd.reset();
        let start = Instant::now();
        pool.install(|| herd.run());
        let steps = (options.robots * scene::STEPS) as f64;
        times.push(start.elapsed().as_secs_f64() * 1e6 / steps);
    }
    times
}

fn report(
    scene: &Scene,
    median: f64,
    fastest: f64,
    operations: Option<Operations>,
    peak: f64,
    options: &Options,
) {
    let flops = operations.map(|o| o.flops());
    let share = flops.map(|flops| flops / (median * 1e-6) / (peak * options.threads as f64));
    if options.json {
        let text = |value: Option<f64>| value.map_or("null".into(), |value| value.to_string());
        println!(
            r#"{{"scene":"{}","robots":{},"threads":{},"us_median":{median},"us_fastest":{fastest},"flops":{},"peak_share":{}}}"#,
            scene.name,
            options.robots,
            options.threads,
            text(flops),
            text(share),
        );
    } else {
        let text = |value: Option<f64>, digits: usize| value.map_or("-".into(), |v| format!("{v:.digits$}"));
        let percent = text(share.map(|share| share * 100.0), 0);
        let flops = text(flops, 0);
        println!("{:<14} {median:>16.3} {fastest:>16.3} {flops:>12} {percent:>9}%", scene.name);
        if let Some(operations) = operations {
            println!("{:<14} {operations}", "");
        }
    }
}

fn parse(mut words: impl Iterator<Item = String>) -> Result<Option<Options>, String> {
    let mut options =
        Options { scene: None, robots: 1024, threads: 1, seconds: 3.0, json: false, count: false };
    while let Some(word) = words.next() {
        let mut value = || words.next().ok_or(format!("{word} needs a value"));
        match word.as_str() {
            "--scene" => options.scene = Some(value()?),
            "--robots" => options.robots = number(&word, &value()?)?,
            "--threads" => options.threads = number(&word, &value()?)?,
            "--seconds" => options.seconds = number(&word, &value()?)?,
            "--json" => options.json = true,
            "--count" => options.count = true,
            "--bench" => {} // cargo adds it
            "--help" => return Ok(None),
            _ => return Err(format!("{word} is no option")),
        }
    }
    if let Some(name) = &options.scene
        && !SCENES.iter().any(|scene| scene.name == name)
    {
        return Err(format!("no scene {name}; there are {}", SCENES.map(|scene| scene.name).join(", ")));
    }
    if options.robots == 0 || !options.robots.is_multiple_of(16) {
        return Err(format!("--robots is {}, must be a multiple of 16 above 0", options.robots));
    }
    Ok(Some(options))
}

fn number<T: std::str::FromStr>(name: &str, text: &str) -> Result<T, String> {
    text.parse().map_err(|_| format!("{name} is {text}, must be a number"))
}
