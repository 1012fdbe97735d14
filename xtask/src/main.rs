//! `cargo run -p xtask -- CHORE`.

use std::path::Path;
use std::process::ExitCode;

const USAGE: &str = "\
usage: cargo run -p xtask -- web

  web    builds the page of `guidedog play` into apps/web/dist: the WebAssembly module (adds the target
         wasm32-unknown-unknown with rustup if it is missing), the scripts (needs Node.js with npm), the manifest";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("xtask is inside the repository");
    if arguments != ["web"] {
        eprintln!("{USAGE}");
        return ExitCode::from(2);
    }
    match xtask::web::build(root) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
