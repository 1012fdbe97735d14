//! `guidedog play`: the dog in a browser.

use std::process::ExitCode;

use anyhow::Result;
use clap::Args;

use super::serving::Serving;

/// Opens the dog in a browser: take the handle and pull
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    #[command(flatten)]
    serving: Serving,
}

const EXAMPLES: &str = "\
Examples:
  guidedog play
  guidedog play --port 8080 --no-open

The simulation runs in the page, by WebAssembly; this program only hands it out. The same page works
from any web server: copy apps/web/dist.";

pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode> {
    let server = arguments.serving.bind()?;
    arguments.serving.announce(&server, "")?;
    guidedog::tell!("the dog waits there; Ctrl-C ends");
    server.serve();
    Ok(ExitCode::SUCCESS)
}
