//! How a verb serves the page: where, and whether a browser is asked to open it.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};
use std::process::{Command, Stdio};

use anyhow::{Context as _, Result};
use clap::Args;
use guidedog::error::OrBadInput as _;
use guidedog::server::{FILES, Server};
use guidedog::{say, tell};

#[derive(Clone, Debug, PartialEq, Args)]
pub(crate) struct Serving {
    /// Port to serve the page on [default: any that is free]
    #[arg(long, default_value_t = 0, hide_default_value = true)]
    port: u16,
    /// Address to serve the page on; others than loopback can be reached from elsewhere
    #[arg(long, default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST))]
    host: IpAddr,
    /// Only print the page's address
    #[arg(long)]
    no_open: bool,
}

impl Serving {
    /// What is so if nothing is said.
    pub(crate) fn usual() -> Self {
        Self { port: 0, host: IpAddr::V4(Ipv4Addr::LOCALHOST), no_open: false }
    }

    /// A server of the page that listens already.
    pub(crate) fn bind(&self) -> Result<Server> {
        let wanted = SocketAddr::new(self.host, self.port);
        Ok(Server::bind(wanted, FILES).or_bad_input(|| format!("cannot serve on {wanted}"))?)
    }

    /// Prints the page's address, with what comes after the host, and opens it in a browser unless told not to.
    pub(crate) fn announce(&self, server: &Server, path: &str) -> Result<()> {
        let mut at = server.address().context("the address served on")?;
        if at.ip().is_unspecified() {
            // All addresses of this machine; no browser can be sent to "all".
            at.set_ip(if at.is_ipv4() { Ipv4Addr::LOCALHOST.into() } else { Ipv6Addr::LOCALHOST.into() });
        }
        let address = format!("http://{at}/{path}");
        say!("{address}");
        if !self.host.is_loopback() {
            tell!("warning: {} can be reached from other machines, at port {}", self.host, at.port());
        }
        if !self.no_open {
            open(&address);
        }
        Ok(())
    }
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
    let mut command = Command::new(program);
    command.arg(address).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    // Ctrl-C, which stops a training, is not meant for the browser.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    match command.spawn() {
        Ok(mut opener) => drop(std::thread::spawn(move || opener.wait())),
        Err(_) => tell!("no {program} here: open the address in a browser"),
    }
}
