//! `guidedog play`: the dog in a browser.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::process::{Command, ExitCode, Stdio};

use anyhow::{Context as _, Result};
use clap::Args;
use guidedog::error::OrBadInput as _;
use guidedog::server::{FILES, Server};

/// Opens the dog in a browser: take the handle and pull
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// Port to serve the page on [default: any that is free]
    #[arg(long, default_value_t = 0, hide_default_value = true)]
    port: u16,
    /// Address to serve the page on; others than loopback can be reached from elsewhere
    #[arg(long, default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST))]
    host: IpAddr,
    /// Only print the address
    #[arg(long)]
    no_open: bool,
}

const EXAMPLES: &str = "\
Examples:
  guidedog play
  guidedog play --port 8080 --no-open

The simulation runs in the page, by WebAssembly; this program only hands it out. The same page works
from any web server: copy apps/web/dist.";

pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode> {
    let wanted = SocketAddr::new(arguments.host, arguments.port);
    let server = Server::bind(wanted, FILES).or_bad_input(|| format!("cannot serve on {wanted}"))?;
    let address = format!("http://{}/", server.address().context("the address served on")?);
    println!("{address}");
    eprintln!("the dog waits there; Ctrl-C ends");
    if !arguments.host.is_loopback() {
        eprintln!("warning: {} can be reached from other machines", arguments.host);
    }
    if !arguments.no_open {
        open(&address);
    }
    server.serve().context("the server")?;
    Ok(ExitCode::SUCCESS)
}

/// Asks the desktop to open an address; where there is none, the printed address has to do.
fn open(address: &str) {
    let program = if cfg!(target_os = "macos") {
        "open"
    } else if cfg!(target_os = "windows") {
        "explorer"
    } else {
        "xdg-open"
    };
    let quiet = Command::new(program).arg(address).stdout(Stdio::null()).stderr(Stdio::null()).spawn();
    if quiet.is_err() {
        eprintln!("no {program} here: open the address in a browser");
    }
}
