//! How often a robot changes its mind under one and the same force.

use crate::{
    measures::reading::nearest,
    recording::{MEAN_STEPS, STEP_S, Sample, half_seconds},
};

/// Changes of what the motion looks like, from one half second to the next, per ten seconds.
pub fn switches_per_10s(samples: &[Sample], force_y: f64) -> f64 {
    let read: Vec<_> = half_seconds(samples).map(|velocity| nearest(velocity, force_y)).collect();
    let switches = read.windows(2).filter(|pair| pair[0] != pair[1]).count();
    switches as f64 * 10.0 / (read.len() * MEAN_STEPS) as f64 / STEP_S
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::by_hand::drive;

    #[test]
    fn changes_are_counted_and_the_gait_is_none() {
        // Ten seconds of walking with a strong ripple of two strides a second.
        let gait = |t: f64| 0.3 * (std::f64::consts::TAU * 4.0 * t).sin();
        assert_eq!(switches_per_10s(&drive(500, |t| [0.7 + gait(t), 0.0, gait(t)]), 0.0), 0.0);
        // Stands from second 2 to 3 and from 6 on: three changes; in five seconds a change counts twice.
        let moving = |t: f64| !(2.01..3.01).contains(&t) && t < 6.01;
        let samples = drive(500, |t| [if moving(t) { 0.8 } else { 0.0 }, 0.0, 0.0]);
        assert_eq!(switches_per_10s(&samples, 0.0), 3.0);
        assert_eq!(switches_per_10s(&samples[..250], 0.0), 4.0);
    }
}
