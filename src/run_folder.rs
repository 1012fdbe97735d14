//! `runs/<name>/`: everything one training run leaves behind, written by one process at a time.
//!
//! ```text
//! config.toml  metrics.csv  events.out.tfevents.*  checkpoints/  policy.onnx  report.html  results.json
//! ```

use std::fs::{self, File, TryLockError};
use std::io::{self, Read as _, Seek as _, Write as _};
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result};

use crate::error::{BadInput, with_causes};

pub use policy::write_atomic;

const CHECKPOINTS: &str = "checkpoints";
const BEST: &str = "best.safetensors";

/// A run's folder, locked for this process for as long as the value lives.
#[derive(Debug)]
pub struct RunFolder {
    path: PathBuf,
    /// The operating system frees the lock with the process, so a crash leaves nothing to clean up.
    _lock: File,
}

impl RunFolder {
    /// Makes (or enters) the folder `root/name` and locks it.
    ///
    /// # Errors
    /// The name is not a plain folder name, another process holds the folder, or the disk refuses.
    pub fn open(root: &Path, name: &str) -> Result<Self> {
        let plain = !name.is_empty()
            && !name.starts_with('.')
            && name.chars().all(|c| c.is_alphanumeric() || matches!(c, '-' | '_' | '.'));
        if !plain {
            return Err(
                BadInput::new(format!("run name {name:?}: use letters, digits, '-', '_' and '.'")).into()
            );
        }
        let path = root.join(name);
        fs::create_dir_all(path.join(CHECKPOINTS))
            .with_context(|| format!("cannot create the run folder {}", path.display()))?;
        let _lock = lock(&path)?;
        for folder in [&path, &path.join(CHECKPOINTS)] {
            remove_half_written(folder).with_context(|| format!("cannot clean up {}", folder.display()))?;
        }
        Ok(Self { path, _lock })
    }

    /// The folder itself.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// A file in the folder.
    pub fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// Where the checkpoint of an iteration lies.
    pub fn checkpoint(&self, iteration: u64) -> PathBuf {
        self.path.join(CHECKPOINTS).join(format!("{iteration:08}.safetensors"))
    }

    /// Where the best checkpoint so far lies.
    pub fn best_checkpoint(&self) -> PathBuf {
        self.path.join(CHECKPOINTS).join(BEST)
    }

    /// Numbered checkpoints, the newest first.
    ///
    /// # Errors
    /// The folder cannot be read.
    pub fn checkpoints(&self) -> io::Result<Vec<(u64, PathBuf)>> {
        numbered_checkpoints(&self.path)
    }

    /// Removes all numbered checkpoints but the `kept` newest.
    ///
    /// # Errors
    /// The folder cannot be read or a file not removed.
    pub fn prune_checkpoints(&self, kept: usize) -> io::Result<()> {
        self.checkpoints()?.into_iter().skip(kept.max(1)).try_for_each(|(_, path)| fs::remove_file(path))
    }

    /// Loads the newest checkpoint that `load` accepts; `report` hears of each one that was passed over. Those are set aside, so that
    /// no later save takes them for newer than itself.
    ///
    /// # Errors
    /// There are checkpoints, but `load` accepts none of them; then all stay where they are. The disk refuses.
    pub fn load_newest<T>(
        &self,
        mut load: impl FnMut(&Path) -> Result<T>,
        mut report: impl FnMut(&str),
    ) -> Result<Option<T>> {
        let checkpoints = self.checkpoints()?;
        for (passed_over, (_, path)) in checkpoints.iter().enumerate() {
            match load(path) {
                Ok(value) => {
                    for (_, damaged) in &checkpoints[..passed_over] {
                        fs::rename(damaged, damaged.with_extension("damaged"))
                            .with_context(|| format!("cannot set aside {}", damaged.display()))?;
                    }
                    return Ok(Some(value));
                }
                Err(error) => report(&format!("{} is not usable ({})", path.display(), with_causes(&error))),
            }
        }
        if checkpoints.is_empty() {
            return Ok(None);
        }
        anyhow::bail!(
            "none of the {} checkpoints in {} can be loaded",
            checkpoints.len(),
            self.path.display()
        )
    }
}

/// The numbered checkpoints of the run at `path`, the newest first.
///
/// # Errors
/// The folder cannot be read.
pub fn numbered_checkpoints(path: &Path) -> io::Result<Vec<(u64, PathBuf)>> {
    let mut found: Vec<(u64, PathBuf)> = fs::read_dir(path.join(CHECKPOINTS))?
        .filter_map(|entry| {
            let path = entry.ok()?.path();
            (path.extension()? == "safetensors")
                .then(|| Some((path.file_stem()?.to_str()?.parse().ok()?, path.clone())))?
        })
        .collect();
    found.sort_by_key(|(iteration, _)| std::cmp::Reverse(*iteration));
    Ok(found)
}

/// Whether a process once held the run at `path` and none does now; false where there is no such folder.
pub fn is_left(path: &Path) -> bool {
    let lock = File::open(path.join("lock"));
    lock.is_ok_and(|lock| !matches!(lock.try_lock_shared(), Err(TryLockError::WouldBlock)))
}

/// Removes what a process that was killed while it wrote left half-written; the caller holds the lock.
fn remove_half_written(folder: &Path) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.extension().is_some_and(|extension| extension == "tmp") {
            fs::remove_file(path)?;
        }
    }
    Ok(())
}

fn lock(folder: &Path) -> Result<File> {
    let path = folder.join("lock");
    let mut file = File::options()
        .read(true)
        .write(true)
        .create(true)
        .truncate(false)
        .open(&path)
        .with_context(|| format!("cannot open {}", path.display()))?;
    match file.try_lock() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => {
            let mut holder = String::new();
            let _ = file.read_to_string(&mut holder);
            anyhow::bail!(
                "{} is in use by process {}: wait for it, or choose another --name",
                folder.display(),
                holder.trim()
            );
        }
        Err(TryLockError::Error(error)) => {
            return Err(error).with_context(|| format!("cannot lock {}", path.display()));
        }
    }
    file.set_len(0)?;
    file.rewind()?;
    writeln!(file, "{}", std::process::id())?;
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_process_is_refused_until_the_first_is_gone() {
        let root = tempfile::tempdir().unwrap();
        let first = RunFolder::open(root.path(), "a").unwrap();
        let message = RunFolder::open(root.path(), "a").unwrap_err().to_string();
        assert!(message.contains(&format!("process {}", std::process::id())), "{message}");
        RunFolder::open(root.path(), "b").expect("another run is free");
        assert!(
            !is_left(first.path()) && is_left(&root.path().join("b")) && !is_left(&root.path().join("c"))
        );
        drop(first);
        RunFolder::open(root.path(), "a").expect("the lock went with its holder");
    }

    #[test]
    fn a_damaged_checkpoint_falls_back_to_the_one_before_and_says_so() {
        let root = tempfile::tempdir().unwrap();
        let run = RunFolder::open(root.path(), "a").unwrap();
        for (iteration, text) in [(10, "ten"), (20, "twenty"), (30, "")] {
            write_atomic(&run.checkpoint(iteration), text.as_bytes()).unwrap();
        }
        let load = |path: &Path| {
            let text = fs::read_to_string(path)?;
            anyhow::ensure!(!text.is_empty(), "empty");
            Ok(text)
        };
        let mut said = Vec::new();
        let loaded = run.load_newest(load, |line| said.push(line.to_owned())).unwrap();
        assert_eq!(loaded.as_deref(), Some("twenty"));
        assert!(
            said.len() == 1 && said[0].contains("00000030.safetensors is not usable (empty)"),
            "{said:?}"
        );
        assert!(run.load_newest(|_| -> Result<()> { anyhow::bail!("no") }, |_| {}).is_err());
        // What is saved from there on is the newest again.
        write_atomic(&run.checkpoint(25), b"twenty-five").unwrap();
        run.prune_checkpoints(1).unwrap();
        let left: Vec<u64> = run.checkpoints().unwrap().into_iter().map(|(iteration, _)| iteration).collect();
        assert_eq!(left, [25]);
        assert!(run.checkpoint(30).with_extension("damaged").exists());
    }

    #[test]
    fn pruning_keeps_the_newest_and_the_best() {
        let root = tempfile::tempdir().unwrap();
        let run = RunFolder::open(root.path(), "a").unwrap();
        for iteration in [1, 2, 10, 9, 3] {
            fs::write(run.checkpoint(iteration), "x").unwrap();
        }
        fs::write(run.best_checkpoint(), "x").unwrap();
        run.prune_checkpoints(3).unwrap();
        let left: Vec<u64> = run.checkpoints().unwrap().into_iter().map(|(iteration, _)| iteration).collect();
        assert_eq!(left, [10, 9, 3]);
        assert!(run.best_checkpoint().exists());
    }

    #[test]
    fn a_name_that_leaves_the_root_is_refused() {
        let root = tempfile::tempdir().unwrap();
        for name in ["", "..", "a/b", "../x", ".hidden"] {
            assert!(RunFolder::open(root.path(), name).unwrap_err().is::<BadInput>(), "{name}");
        }
    }
}
