//! How far a long piece of work is: on a terminal a bar with what matters below it, in place; in a log a plain line now and then.

use std::io::IsTerminal as _;
use std::time::{Duration, Instant};

use indicatif::{HumanDuration, ProgressBar, ProgressStyle};

/// Time from the beginning to the first line of a log, and from then on from one to the next.
const PLAIN_FIRST: Duration = Duration::from_secs(10);
const PLAIN_PERIOD: Duration = Duration::from_secs(60);
/// Longest line below a bar; narrower than any terminal in use.
const WIDTH: usize = 78;
/// Stands between the parts of a message, where its lines may be broken.
pub const GAP: &str = "  ";

/// Progress of work that is counted in equal steps. Everything goes to stderr: stdout belongs to results.
#[derive(Debug)]
pub struct Progress {
    what: String,
    bar: ProgressBar,
    terminal: bool,
    first: u64,
    started: Instant,
    next_line: Instant,
}

impl Progress {
    /// Work called `what` of `total` steps, of which `done` were made by an earlier process.
    pub fn new(what: impl Into<String>, done: u64, total: u64) -> Self {
        let what = what.into();
        let terminal = std::io::stderr().is_terminal();
        let bar = if terminal { ProgressBar::new(total) } else { ProgressBar::hidden() };
        bar.set_style(style());
        bar.set_length(total);
        bar.set_prefix(what.clone());
        bar.set_position(done);
        bar.reset_eta();
        let now = Instant::now();
        Self { what, bar, terminal, first: done, started: now, next_line: now + PLAIN_FIRST }
    }

    /// `done` steps are made; `message` says what matters at this moment (rate, scores), its parts set apart by [`GAP`].
    pub fn update(&mut self, done: u64, message: &str) {
        self.bar.set_position(done);
        if self.terminal {
            self.bar.set_message(below(message));
        } else if Instant::now() >= self.next_line {
            self.next_line = Instant::now() + PLAIN_PERIOD;
            self.plain_line(done, message);
        }
    }

    /// Prints a line that stays, above the bar.
    pub fn say(&self, line: &str) {
        if self.terminal { self.bar.println(line) } else { crate::tell!("{line}") }
    }

    /// Ends the bar; its last state stays on the screen.
    pub fn finish(&self, message: &str) {
        if self.terminal {
            self.bar.abandon_with_message(below(message));
        } else {
            self.plain_line(self.bar.position(), message);
        }
    }

    fn plain_line(&self, done: u64, message: &str) {
        let total = self.bar.length().unwrap_or(0);
        let left =
            time_left(self.started.elapsed(), done.saturating_sub(self.first), total.saturating_sub(done));
        let left = left.map_or(String::new(), |left| format!(", {} left", HumanDuration(left)));
        crate::tell!("{} {done}/{total}{left}  {message}", self.what);
    }
}

fn style() -> ProgressStyle {
    ProgressStyle::with_template("{prefix} {bar:24} {pos}/{len} [{elapsed} < {eta}]{msg}")
        .unwrap_or_else(|_| ProgressStyle::default_bar())
}

/// A message in lines of its own, none too long.
fn below(message: &str) -> String {
    let mut text = String::new();
    let mut used = WIDTH;
    for part in message.split(GAP).filter(|part| !part.is_empty()) {
        let width = part.chars().count() + GAP.len();
        if used + width > WIDTH {
            text.push('\n');
            used = 0;
        }
        text += GAP;
        text += part;
        used += width;
    }
    text
}

/// Time for `left` more steps at the mean pace so far; unknown before the first step.
fn time_left(elapsed: Duration, made: u64, left: u64) -> Option<Duration> {
    (made > 0).then(|| elapsed.mul_f64(left as f64 / made as f64))
}

/// A count with a thousands suffix: `1234567.0` is `1.23M`.
pub fn short_count(value: f64) -> String {
    match value.abs() {
        v if v >= 1e9 => format!("{:.2}G", value / 1e9),
        v if v >= 1e6 => format!("{:.2}M", value / 1e6),
        v if v >= 1e3 => format!("{:.1}k", value / 1e3),
        _ => format!("{value:.0}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_left_follows_the_pace_of_this_process() {
        let second = Duration::from_secs(1);
        assert_eq!(time_left(10 * second, 5, 20), Some(40 * second));
        assert_eq!(time_left(10 * second, 0, 20), None);
    }

    #[test]
    fn a_message_is_broken_between_its_parts() {
        assert_eq!(below(""), "");
        assert_eq!(below("12k steps/s  kl 0.01"), "\n  12k steps/s  kl 0.01");
        let parts: Vec<String> = (0..9).map(|i| format!("behavior_reward/{i} 0.123")).collect();
        let text = below(&parts.join(GAP));
        assert_eq!(text.lines().count(), 1 + 3);
        assert!(text.lines().all(|line| line.chars().count() <= WIDTH), "{text}");
        assert!(parts.iter().all(|part| text.contains(part)));
    }

    #[test]
    fn counts_are_short() {
        assert_eq!(short_count(12.0), "12");
        assert_eq!(short_count(12_345.0), "12.3k");
        assert_eq!(short_count(1_234_567.0), "1.23M");
        assert_eq!(short_count(2.5e9), "2.50G");
    }
}
