//! Every configuration in `configs/` resolves, validates and builds its environments.

use std::path::Path;

use guidedog::config::resolve;
use guidedog::learner::Trainable as _;
use guidedog::run_config::{LocomotionRun, Run, SupervisorRun, TaskConfig};
use serde_json::Value;
use tasks::guidance::PullConfig;

fn files(folder: &str) -> Vec<std::path::PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs").join(folder);
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let files: Vec<_> = files.filter(|path| path.is_file()).collect();
    assert!(!files.is_empty());
    files
}

#[test]
fn locomotion_configurations_can_be_trained() {
    for file in files("locomotion") {
        let config: LocomotionRun = resolve(Some(&file), &[]).unwrap();
        config.validate().unwrap();
        config.task.environments(16, 1).unwrap();
    }
}

#[test]
fn supervisor_configurations_can_be_trained() {
    for file in files("supervisor") {
        let config: SupervisorRun = resolve(Some(&file), &[]).unwrap();
        config.validate().unwrap();
        config.task.environments(16, 1).unwrap();
    }
}

/// What the paper fixes, and what its framework's defaults are where it does not.
#[test]
fn the_papers_setting_is_the_papers() {
    let file = |name: &str| Path::new(env!("CARGO_MANIFEST_DIR")).join("configs").join(name);
    let walk: LocomotionRun = resolve(Some(&file("locomotion/paper.toml")), &[]).unwrap();
    assert_eq!((walk.training.num_envs, walk.ppo.steps_per_env), (4096, 24));
    let framework = ppo::Config::default();
    assert_eq!(walk.ppo, framework);
    assert_eq!((walk.task.command.standing_below, walk.task.reward.fall), (0.0, 0.0));
    let guide: SupervisorRun = resolve(Some(&file("supervisor/paper.toml")), &[]).unwrap();
    assert_eq!((guide.training.num_envs, guide.training.iterations), (4096, 3000));
    let hidden = vec![128, 128, 128];
    assert_eq!(guide.ppo, ppo::Config { actor_hidden: hidden.clone(), critic_hidden: hidden, ..framework });
    assert_eq!(guide.task.pull, PullConfig::paper());
    assert_eq!(guide.task.threshold_margin_n, [0.0, 0.0]);
    assert_eq!(guide.task.command_rate, -1e-4);
    assert_eq!((guide.task.heading_drift, guide.task.place_drift, guide.task.fall), (0.0, 0.0, 0.0));
}

/// What a field's description says may be in it: `[unit; low to high]`, or `above low to high`.
struct Allowed {
    low: f64,
    high: f64,
    above_low: bool,
}

impl Allowed {
    fn read(description: &str) -> Option<Self> {
        let (_, rest) = description.split_once("\\[")?;
        let (inside, _) = rest.split_once("\\]")?;
        let (unit, range) = inside.split_once("; ")?;
        let (low, high) = range.split_once(" to ")?;
        let (low, above_low) = low.strip_prefix("above ").map_or((low, false), |low| (low, true));
        (!unit.is_empty()).then_some(Self { low: low.parse().ok()?, high: high.parse().ok()?, above_low })
    }

    /// The smallest and the largest value, and two just outside.
    fn probes(&self, whole: bool) -> [f64; 4] {
        let step =
            |bound: f64| if whole { 1.0_f64.max(bound.abs() * 1e-9) } else { bound.abs().max(1e-3) * 1e-3 };
        let least = match (self.above_low, whole) {
            (false, _) => self.low,
            (true, true) => self.low + 1.0,
            (true, false) => self.low + 1e-9,
        };
        let below = if self.above_low { self.low } else { self.low - step(self.low) };
        [least, self.high, below, self.high + step(self.high)]
    }
}

/// Leaves of the settings with their dotted key, default and description.
fn leaves(table: &toml::Table, schema: &Value, prefix: &str, out: &mut Vec<(String, toml::Value, String)>) {
    for (key, value) in table {
        let path = if prefix.is_empty() { key.clone() } else { format!("{prefix}.{key}") };
        let field = &schema["properties"][key];
        match value {
            toml::Value::Table(inner) => leaves(inner, field, &path, out),
            value => {
                let description = field["description"].as_str().unwrap_or_default().replace('\n', " ");
                out.push((path, value.clone(), description));
            }
        }
    }
}

/// Settings that other settings bound more narrowly than their own range does.
const ENTANGLED: [&str; 4] = ["learning_rate", "learning_rate_range", "supervisor_period_s", "_share"];

fn every_setting_says_what_it_may_be<T: TaskConfig>() {
    let inline =
        schemars::generate::SchemaSettings::default().with(|settings| settings.inline_subschemas = true);
    let schema = schemars::SchemaGenerator::new(inline).into_root_schema_for::<Run<T>>();
    let mut found = Vec::new();
    leaves(&toml::Table::try_from(Run::<T>::default()).unwrap(), schema.as_value(), "", &mut found);
    assert!(found.len() > 40);
    for (key, value, description) in found {
        assert!(description.contains("Source: "), "{key} has no source: {description:?}");
        let is_number = |value: &toml::Value| value.is_integer() || value.is_float();
        let numbers = value.as_array().map_or(usize::from(is_number(&value)), Vec::len);
        if numbers == 0 {
            continue;
        }
        let allowed = Allowed::read(&description)
            .unwrap_or_else(|| panic!("{key} has no `[unit; low to high]`: {description:?}"));
        let whole = value.as_array().map_or(&value, |values| &values[0]).is_integer();
        let validated = |number: f64| {
            let text = if whole { format!("{}", number as i64) } else { format!("{number:?}") };
            let text = if value.is_array() { format!("[{}]", vec![text; numbers].join(", ")) } else { text };
            let setting = format!("{key}={text}");
            let resolved = resolve::<Run<T>>(None, std::slice::from_ref(&setting)).map_err(|e| e.to_string());
            (setting, resolved.and_then(|run| run.validate().map_err(|e| e.to_string())))
        };
        let [least, most, below, above] = allowed.probes(whole);
        for number in [below, above] {
            let (setting, outcome) = validated(number);
            let message = outcome.err().unwrap_or_else(|| panic!("{setting} is accepted: {description}"));
            let name = key.rsplit('.').next().unwrap();
            // Below zero and beyond four bytes it is the type that refuses.
            assert!(message.contains(name), "{setting}: {message}");
        }
        if !ENTANGLED.iter().any(|name| key.ends_with(name)) {
            for number in [least, most] {
                let (setting, outcome) = validated(number);
                assert_eq!(outcome, Ok(()), "{setting}: {description}");
            }
        }
    }
}

#[test]
fn every_setting_says_its_unit_range_and_source_and_is_held_to_them() {
    every_setting_says_what_it_may_be::<tasks::locomotion::LocomotionConfig>();
    every_setting_says_what_it_may_be::<tasks::guidance::GuidanceConfig>();
}
