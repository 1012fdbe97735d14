//! Builds the page: the WebAssembly module, the bundled scripts, the files beside them.

use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context as _, Result, bail};

use crate::manifest::{self, DIST};

const TARGET: &str = "wasm32-unknown-unknown";
/// Files that are taken as they are: from, to.
const COPIED: [(&str, &str); 4] = [
    ("apps/web/page/index.html", "index.html"),
    ("apps/web/page/style.css", "style.css"),
    ("policies/locomotion.onnx", "policies/locomotion.onnx"),
    ("policies/supervisor.onnx", "policies/supervisor.onnx"),
];

/// Builds everything in `apps/web/dist` anew, then its manifest.
///
/// # Errors
/// A tool is missing or refuses; the message says which and what to do.
pub fn build(root: &Path) -> Result<()> {
    let dist = root.join(DIST);
    require_target()?;
    let module = module(root)?;
    scripts(root)?;
    fs::create_dir_all(dist.join("policies"))?;
    fs::copy(&module, dist.join("simulation.wasm")).with_context(|| module.display().to_string())?;
    for (from, to) in COPIED {
        fs::copy(root.join(from), dist.join(to)).with_context(|| from.to_owned())?;
    }
    let text = manifest::to_text(&manifest::compute(root)?);
    fs::write(dist.join(manifest::NAME), text)?;
    println!("built: {DIST}");
    Ok(())
}

/// Adds the target if rustup can.
fn require_target() -> Result<()> {
    let sysroot = Command::new("rustc").args(["--print", "sysroot"]).output().context("rustc")?;
    let sysroot = String::from_utf8_lossy(&sysroot.stdout).trim().to_owned();
    if Path::new(&sysroot).join("lib/rustlib").join(TARGET).is_dir() {
        return Ok(());
    }
    println!("adding the target {TARGET}");
    let added = Command::new("rustup").args(["target", "add", TARGET]).status();
    if !added.is_ok_and(|status| status.success()) {
        bail!(
            "the standard library for {TARGET} is missing and `rustup target add {TARGET}` did not bring it"
        );
    }
    Ok(())
}

/// Compiles the module; returns its path.
fn module(root: &Path) -> Result<std::path::PathBuf> {
    // Of its own, so that flags that differ do not throw away what is built for this machine.
    let target = root.join("target/web");
    let home = std::env::var("CARGO_HOME")
        .or_else(|_| std::env::var("HOME").map(|home| format!("{home}/.cargo")))
        .unwrap_or_default();
    // Messages of panics name source files: where those are on this machine is nobody's business.
    let mut flags = vec![
        "-Ctarget-feature=+simd128".to_owned(),
        format!("--remap-path-prefix={}=guidedog", root.display()),
    ];
    for registry in fs::read_dir(format!("{home}/registry/src")).into_iter().flatten() {
        flags.push(format!("--remap-path-prefix={}=crates", registry?.path().display()));
    }
    run(Command::new(env!("CARGO"))
        .args(["build", "--locked", "--profile", "web", "--package", "guidedog-web", "--lib"])
        .args(["--target", TARGET, "--target-dir"])
        .arg(&target)
        .env("CARGO_ENCODED_RUSTFLAGS", flags.join("\x1f"))
        .current_dir(root))?;
    Ok(target.join(TARGET).join("web/web.wasm"))
}

/// Checks and bundles the scripts.
fn scripts(root: &Path) -> Result<()> {
    let folder = root.join("apps/web");
    for words in [["ci", "--no-progress"], ["run", "build"]] {
        run(Command::new("npm").args(words).current_dir(&folder))
            .context("the scripts need Node.js 20 or later with npm")?;
    }
    Ok(())
}

fn run(command: &mut Command) -> Result<()> {
    let words = format!("{command:?}");
    let status = command.status().with_context(|| words.clone())?;
    if !status.success() {
        bail!("{words}: {status}");
    }
    Ok(())
}
