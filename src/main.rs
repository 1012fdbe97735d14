//! The command line. One verb, one file in `verbs/`.

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use guidedog::error::{BadInput, with_causes};

mod verbs;

use verbs::{bench, config, evaluate, inspect, picture, play, reproduce, train};

/// Trains, judges and shows a robotic guide dog that understands the pull of a hand on its harness.
#[derive(Debug, Parser)]
#[command(version, arg_required_else_help = true, after_help = EXAMPLES)]
struct Cli {
    #[command(subcommand)]
    verb: Verb,
}

const EXAMPLES: &str = "\
Examples:
  guidedog reproduce                         train the supervisor, judge it, write the report
  guidedog train locomotion --name walk      train the walking policy into runs/walk
  guidedog train supervisor --name guide     train its supervisor
  guidedog evaluate                          judge the shipped policies on seventeen pulls
  guidedog bench learning --task flat        how long learning takes on this machine
  guidedog play                              the dog in a browser: take the handle
  guidedog inspect robot                     ANYmal D with its harness";

#[derive(Debug, Subcommand)]
enum Verb {
    Reproduce(reproduce::Arguments),
    Train(train::Arguments),
    Evaluate(evaluate::Arguments),
    Picture(picture::Arguments),
    Config(config::Arguments),
    Bench(bench::Arguments),
    Play(play::Arguments),
    Inspect(inspect::Arguments),
}

fn main() -> ExitCode {
    let result = match Cli::parse().verb {
        Verb::Reproduce(arguments) => reproduce::run(&arguments),
        Verb::Train(arguments) => train::run(&arguments),
        Verb::Evaluate(arguments) => evaluate::run(&arguments),
        Verb::Picture(arguments) => picture::run(&arguments),
        Verb::Config(arguments) => config::run(&arguments),
        Verb::Bench(arguments) => bench::run(&arguments),
        Verb::Play(arguments) => play::run(&arguments),
        Verb::Inspect(arguments) => inspect::run(&arguments),
    };
    result.unwrap_or_else(|error| {
        guidedog::tell!("error: {}", with_causes(&error));
        // As clap does for flags it refuses.
        ExitCode::from(if error.chain().any(|cause| cause.is::<BadInput>()) { 2 } else { 1 })
    })
}
