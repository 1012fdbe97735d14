//! `guidedog config`: what a training would be configured with, and what every setting means.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context as _, Result};
use clap::{Args, Subcommand};
use guidedog::config::resolve;
use guidedog::run_config::{LocomotionRun, Run, SupervisorRun, TaskConfig};
use guidedog::say;
use serde_json::Value;

/// Shows the settings of a training: as resolved, or with the meaning of every one
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    what: What,
}

const EXAMPLES: &str = "\
Examples:
  guidedog config locomotion                             the defaults, as TOML
  guidedog config locomotion --config my.toml            my settings over the defaults, checked
  guidedog config supervisor --explain                   every setting: meaning, unit, range, source
  guidedog config supervisor --schema                    JSON Schema, for editors";

#[derive(Debug, Subcommand)]
enum What {
    /// Settings of `guidedog train locomotion`
    Locomotion(Options),
    /// Settings of `guidedog train supervisor`
    Supervisor(Options),
}

#[derive(Debug, Args)]
struct Options {
    /// Settings that differ from the defaults, a TOML file
    #[arg(long)]
    config: Option<PathBuf>,
    /// One setting, e.g. ppo.epochs=3
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Print what every setting means beside its value
    #[arg(long)]
    explain: bool,
    /// Print the JSON Schema
    #[arg(long, conflicts_with = "explain")]
    schema: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode> {
    match &arguments.what {
        What::Locomotion(options) => show(options, resolve_as::<LocomotionRun>(options)?),
        What::Supervisor(options) => show(options, resolve_as::<SupervisorRun>(options)?),
    }
}

fn resolve_as<T: Default + serde::Serialize + serde::de::DeserializeOwned>(options: &Options) -> Result<T> {
    Ok(resolve(options.config.as_deref(), &options.set)?)
}

fn show<T: TaskConfig>(options: &Options, config: Run<T>) -> Result<ExitCode> {
    config.validate()?;
    let schema =
        schemars::SchemaGenerator::new(schemars::generate::SchemaSettings::default().with(|settings| {
            settings.inline_subschemas = true;
        }))
        .into_root_schema_for::<Run<T>>();
    let table = toml::Table::try_from(&config).context("cannot write the configuration")?;
    if options.schema {
        say!("{}", serde_json::to_string_pretty(&schema)?);
    } else if options.explain {
        say!(
            "# What every setting means, [unit; what is allowed], and where it is from. Unit 1: a plain number.\n"
        );
        say!("{}", explained(&table, schema.as_value(), "").trim_end());
    } else {
        say!("{}", toml::to_string(&config)?.trim_end());
    }
    Ok(ExitCode::SUCCESS)
}

/// A table as TOML, the meaning of each key before it.
fn explained(table: &toml::Table, schema: &Value, path: &str) -> String {
    let mut text = String::new();
    let meaning = |key: &str| schema["properties"][key]["description"].as_str().unwrap_or_default();
    let values = table.iter().filter(|(_, value)| !value.is_table());
    for (key, value) in values {
        for line in meaning(key).lines() {
            let _ = writeln!(text, "# {}", line.replace("\\[", "[").replace("\\]", "]"));
        }
        let _ = writeln!(text, "{key} = {}\n", shortest(value));
    }
    for (key, value) in table {
        if let Some(inner) = value.as_table() {
            let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
            let _ = writeln!(text, "# {}\n[{path}]", meaning(key).lines().next().unwrap_or_default());
            text += &explained(inner, &schema["properties"][key], &path);
        }
    }
    text
}

/// A value as TOML; settings are single precision, so a number is written with as few digits as that needs.
fn shortest(value: &toml::Value) -> String {
    match value {
        toml::Value::Float(number) if f64::from(*number as f32) == *number => format!("{:?}", *number as f32),
        toml::Value::Array(values) => {
            format!("[{}]", values.iter().map(shortest).collect::<Vec<_>>().join(", "))
        }
        _ => value.to_string(),
    }
}
