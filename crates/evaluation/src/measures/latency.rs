//! How fast a sudden pull is answered: by the supervisor's command, and by the robot's velocity.

use tasks::guidance::Behavior;

use crate::recording::{MEAN_STEPS, STEP_S, Sample, mean_velocity};

/// Times from the pull's beginning \[s\]; `None`: not within the episode.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Latency {
    /// Until half of the change of the command is given; the wait for the next decision is in it.
    pub command_50_s: Option<f64>,
    /// Until nine tenths of it are.
    pub command_90_s: Option<f64>,
    /// Until the velocity, its mean over the half second around, has made nine tenths of the change.
    pub velocity_90_s: Option<f64>,
}

/// Reactions to the change of the force from `before` to `after` at the sample `change`; `None` if Table II asks for
/// the same velocities under both.
///
/// The change made so far is the projection on the line from one target to the other: 0 at the old one, 1 at the new. A mean over
/// half a second blurs: a velocity that changes at once has made nine tenths of it 0.2 s later.
pub fn latency(samples: &[Sample], change: usize, before: [f32; 3], after: [f32; 3]) -> Option<Latency> {
    let target = |force: [f32; 3]| Behavior::of_force(force).target(force).map(f64::from);
    let (from, to) = (target(before), target(after));
    let way: [f64; 3] = std::array::from_fn(|axis| to[axis] - from[axis]);
    let length: f64 = way.iter().map(|w| w * w).sum();
    if length == 0.0 {
        return None;
    }
    let progress = |v: [f64; 3]| (0..3).map(|axis| (v[axis] - from[axis]) * way[axis]).sum::<f64>() / length;
    // A command holds from the beginning of its step, the sample's velocity is that of its end.
    let command = |share: f64| {
        let given = |s: &Sample| progress(s.command.map(f64::from)) >= share;
        samples[change..].iter().position(given).map(|step| step as f64 * STEP_S)
    };
    // The half second around each moment from the change on; the first reaches back before it, as far as there is something.
    let half = MEAN_STEPS / 2;
    let first = change.max(half);
    let mut around = samples[first - half..].windows(MEAN_STEPS);
    let moving = around.position(|around| progress(mean_velocity(around)) >= 0.9);
    // A sample is the end of its step.
    let middle = |window: usize| (first + window - change + 1) as f64 * STEP_S;
    Some(Latency {
        command_50_s: command(0.5),
        command_90_s: command(0.9),
        velocity_90_s: moving.map(middle),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::by_hand::drive;

    #[test]
    fn a_stop_along_a_straight_line() {
        // From 0.8 m/s to nothing within a second, beginning at 0.5 s: command at once at 0.2 s by three quarters, then all.
        let mut samples = drive(300, |t| [(0.8 * (1.5 - t)).clamp(0.0, 0.8), 0.0, 0.0]);
        for (step, sample) in samples.iter_mut().enumerate() {
            sample.command = [[0.8, 0.2, 0.0][usize::from(step >= 10) + usize::from(step >= 30)], 0.0, 0.0];
        }
        let found = latency(&samples, 0, [0.0; 3], [-60.0, 0.0, 0.0]).unwrap();
        assert_eq!((found.command_50_s, found.command_90_s), (Some(0.2), Some(0.6)));
        // The mean of half a second around t is the line itself until 1.25 s; then (1.75 − t)² · 0.8: a tenth at 1.434 s.
        assert!((found.velocity_90_s.unwrap() - 1.434).abs() < 0.02, "{found:?}");
    }

    #[test]
    fn a_mean_blurs_what_changes_at_once() {
        // At 1 s from 0.8 m/s to nothing. Nine tenths of the 25 samples around are after it when the middle one is the tenth.
        let samples = drive(300, |t| [if t > 1.01 { 0.0 } else { 0.8 }, 0.0, 0.0]);
        let found = latency(&samples, 50, [0.0; 3], [-60.0, 0.0, 0.0]).unwrap();
        assert!((found.velocity_90_s.unwrap() - 0.22).abs() < 0.001, "{found:?}");
    }

    #[test]
    fn what_does_not_come_is_none_and_what_does_not_change_has_no_latency() {
        let samples = drive(300, |_| [0.8, 0.0, 0.3]);
        let found = latency(&samples, 0, [0.0; 3], [0.0, 30.0, 0.0]).unwrap();
        assert_eq!((found.command_50_s, found.command_90_s, found.velocity_90_s), (Some(0.0), None, None));
        assert_eq!(latency(&samples, 0, [0.0; 3], [-20.0, 10.0, 0.0]), None);
    }
}
