//! How far a long piece of work is: a bar on a terminal, a plain line every ten seconds in a log.

use std::io::IsTerminal as _;
use std::time::{Duration, Instant};

use indicatif::{HumanDuration, ProgressBar, ProgressStyle};

const PLAIN_PERIOD: Duration = Duration::from_secs(10);

/// Progress of work that is counted in equal steps. Everything goes to stderr: stdout belongs to results.
#[derive(Debug)]
pub struct Progress {
    what: String,
    bar: ProgressBar,
    terminal: bool,
    first: u64,
    started: Instant,
    last_line: Instant,
}

impl Progress {
    /// Work called `what` of `total` steps, of which `done` were made by an earlier process.
    pub fn new(what: impl Into<String>, done: u64, total: u64) -> Self {
        let what = what.into();
        let terminal = std::io::stderr().is_terminal();
        let bar = if terminal { ProgressBar::new(total) } else { ProgressBar::hidden() };
        bar.set_length(total);
        bar.set_style(style());
        bar.set_prefix(what.clone());
        bar.set_position(done);
        bar.reset_eta();
        let now = Instant::now();
        Self { what, bar, terminal, first: done, started: now, last_line: now }
    }

    /// `done` steps are made; `message` says what matters at this moment (rate, scores).
    pub fn update(&mut self, done: u64, message: &str) {
        self.bar.set_position(done);
        if self.terminal {
            self.bar.set_message(message.to_owned());
        } else if self.last_line.elapsed() >= PLAIN_PERIOD {
            self.last_line = Instant::now();
            self.plain_line(done, message);
        }
    }

    /// Prints a line that stays, above the bar.
    pub fn say(&self, line: &str) {
        if self.terminal { self.bar.println(line) } else { eprintln!("{line}") }
    }

    /// Ends the bar; its last state stays on the screen.
    pub fn finish(&self, message: &str) {
        if self.terminal {
            self.bar.abandon_with_message(message.to_owned());
        } else {
            self.plain_line(self.bar.position(), message);
        }
    }

    fn plain_line(&self, done: u64, message: &str) {
        let total = self.bar.length().unwrap_or(0);
        let left =
            time_left(self.started.elapsed(), done.saturating_sub(self.first), total.saturating_sub(done));
        let left = left.map_or(String::new(), |left| format!(", {} left", HumanDuration(left)));
        eprintln!("{} {done}/{total}{left}  {message}", self.what);
    }
}

fn style() -> ProgressStyle {
    ProgressStyle::with_template("{prefix} {bar:24} {pos}/{len} [{elapsed} < {eta}] {wide_msg}")
        .unwrap_or_else(|_| ProgressStyle::default_bar())
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
    fn counts_are_short() {
        assert_eq!(short_count(12.0), "12");
        assert_eq!(short_count(12_345.0), "12.3k");
        assert_eq!(short_count(1_234_567.0), "1.23M");
        assert_eq!(short_count(2.5e9), "2.50G");
    }
}
