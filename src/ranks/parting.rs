//! What is said when ranks are told to end: by their user, or by `mpirun` because one of them was lost.
//!
//! `mpirun` sends those that are left SIGTERM, and SIGKILL a second later. They cannot know which it is, nor save if one of them
//! is gone; what they can say is where the last checkpoint lies and how to go on.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

use crate::interrupt::Interrupt;
use crate::run_folder::{is_left, numbered_checkpoints};

/// How soon the signal is noticed.
const PERIOD: Duration = Duration::from_millis(50);
/// How long rank 1 waits to see whether rank 0 is still there to speak.
const GRACE: Duration = Duration::from_millis(300);

/// Waits beside the training, on one of `ranks` ranks, for the signal to end, and says where the run at `path` can go on. Rank 0
/// speaks; or rank 1, if it sees the run's folder and rank 0 does not hold it any more.
pub fn tell_when_ended(interrupt: &Interrupt, path: PathBuf, rank: usize, ranks: usize) {
    if ranks == 1 || rank > 1 {
        return;
    }
    let interrupt = interrupt.clone();
    thread::spawn(move || {
        while !interrupt.requested() {
            thread::sleep(PERIOD);
        }
        if rank == 1 {
            thread::sleep(GRACE);
        }
        if rank == 0 || is_left(&path) {
            crate::tell!("{}", message(&path, ranks, std::env::args()));
        }
    });
}

fn message(path: &Path, ranks: usize, arguments: impl Iterator<Item = String>) -> String {
    let mut text = "told to end, by a user or because a rank was lost".to_owned();
    let newest = numbered_checkpoints(path).ok().and_then(|found| found.into_iter().next());
    let _ = match newest {
        Some((_, checkpoint)) => write!(
            text,
            "; unless a later one is saved now, the last checkpoint is {}\ngo on, on any number of ranks, with\n  \
             mpirun -n {ranks} {}",
            checkpoint.display(),
            resumed(arguments)
        ),
        None => write!(text, "; there is no checkpoint in {} yet", path.display()),
    };
    text
}

/// The command that goes on where `arguments` began.
pub fn resumed(mut arguments: impl Iterator<Item = String>) -> String {
    let mut words = Vec::new();
    while let Some(word) = arguments.next() {
        match word.as_str() {
            "--resume" => {}
            // A run begins from another one only once.
            "--init-from" => drop(arguments.next()),
            word if word.starts_with("--init-from=") => {}
            word if word.contains([' ', '[', '"', '\'', '*', '$']) => {
                words.push(format!("'{}'", word.replace('\'', r"'\''")));
            }
            _ => words.push(word),
        }
    }
    words.push("--resume".into());
    words.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_to_go_on_is_the_one_that_began_with_resume() {
        let resumed = |line: &str| resumed(line.split(' ').map(str::to_owned));
        assert_eq!(resumed("guidedog train locomotion"), "guidedog train locomotion --resume");
        assert_eq!(resumed("g train x --resume --name a"), "g train x --name a --resume");
        assert_eq!(resumed("g train x --init-from runs/a --name b"), "g train x --name b --resume");
        assert_eq!(resumed("g train x --init-from=runs/a"), "g train x --resume");
        assert_eq!(
            resumed("g train x --set ppo.actor_hidden=[8,8]"),
            "g train x --set 'ppo.actor_hidden=[8,8]' --resume"
        );
    }

    #[test]
    fn without_a_checkpoint_it_says_so() {
        let said = message(Path::new("no/such/run"), 2, std::iter::empty());
        assert!(said.ends_with("there is no checkpoint in no/such/run yet"), "{said}");
    }
}
