//! What an onlooker reads off a robot: what it does, and how far its heading drifts.

use tasks::{
    guidance::{Behavior, GUIDING_SPEED_MPS, PULL_THRESHOLD_Y_N, YAW_RATE_PER_NEWTON},
    simulation::CONTROL_PERIOD_S,
};

/// Time constant of the mean velocity \[s\]: a stride or so.
const MEAN_S: f32 = 0.3;
/// Half the guiding speed: above it a robot goes \[m/s\].
const GOES_MPS: f32 = 0.5 * GUIDING_SPEED_MPS;
/// Half the slowest turn of Table II: above it a robot turns \[rad/s\].
const TURNS_RADPS: f32 = 0.5 * YAW_RATE_PER_NEWTON * PULL_THRESHOLD_Y_N;
/// A reading changes only when its threshold is passed by this share.
const HYSTERESIS: f32 = 0.15;
/// Time over which heading drift is told \[s\].
pub const HEADING_WINDOW_S: f32 = 10.0;
const WINDOW_STEPS: u32 = (HEADING_WINDOW_S / CONTROL_PERIOD_S) as u32;

/// The reading of one robot since its pull last changed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reading {
    /// v_x, v_y \[m/s\], ω_z \[rad/s\], a running mean.
    pub velocity: [f32; 3],
    goes: bool,
    turns: bool,
    /// Yaw gone in excess of what is wanted \[rad\], and the steps it took.
    excess: f32,
    steps: u32,
}

impl Reading {
    /// Takes in the velocity of a control step, and the yaw rate wanted then \[rad/s\].
    pub fn update(&mut self, velocity: [f32; 3], wanted_yaw_rate: f32) {
        let share = CONTROL_PERIOD_S / MEAN_S;
        for (mean, now) in self.velocity.iter_mut().zip(velocity) {
            *mean += share * (now - *mean);
        }
        let [forward, _, around] = self.velocity;
        self.goes = passes(self.goes, forward, GOES_MPS);
        self.turns = passes(self.turns, around.abs(), TURNS_RADPS);
        // Beyond the window old drift fades, so the figure follows what the robot does now.
        let fade = if self.steps < WINDOW_STEPS { 1.0 } else { 1.0 - 1.0 / WINDOW_STEPS as f32 };
        self.excess = fade * self.excess + (velocity[2] - wanted_yaw_rate) * CONTROL_PERIOD_S;
        self.steps = (self.steps + 1).min(WINDOW_STEPS);
    }

    /// Begins to count drift anew: the pull has changed.
    pub fn forget_drift(&mut self) {
        (self.excess, self.steps) = (0.0, 0);
    }

    /// What the robot does: the behavior of Table II nearest to how it moves.
    pub fn behavior(&self) -> Behavior {
        match (self.goes, self.turns) {
            (true, false) => Behavior::Walk,
            (false, false) => Behavior::Stop,
            (true, true) => Behavior::Turn,
            (false, true) => Behavior::Spin,
        }
    }

    /// Drift of the heading, less what is wanted, since the pull changed or over the last ten seconds \[rad\].
    pub fn heading_drift(&self) -> f32 {
        self.excess
    }
}

fn passes(before: bool, value: f32, threshold: f32) -> bool {
    value > threshold * if before { 1.0 - HYSTERESIS } else { 1.0 + HYSTERESIS }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(velocity: [f32; 3]) -> Behavior {
        let mut reading = Reading::default();
        (0..100).for_each(|_| reading.update(velocity, 0.0));
        reading.behavior()
    }

    #[test]
    fn the_prototypes_of_table_two_are_read_as_themselves() {
        for force in [[0.0, 0.0, 0.0], [-60.0, 0.0, 0.0], [0.0, 30.0, 0.0], [-60.0, -30.0, 0.0]] {
            let behavior = Behavior::of_force(force);
            assert_eq!(read(behavior.target(force)), behavior);
        }
    }

    #[test]
    fn near_a_threshold_the_reading_stays() {
        let mut reading = Reading::default();
        (0..100).for_each(|_| reading.update([0.8, 0.0, 0.0], 0.0));
        (0..100).for_each(|_| reading.update([0.38, 0.0, 0.0], 0.0));
        assert_eq!(reading.behavior(), Behavior::Walk);
        (0..100).for_each(|_| reading.update([0.3, 0.0, 0.0], 0.0));
        assert_eq!(reading.behavior(), Behavior::Stop);
        (0..100).for_each(|_| reading.update([0.42, 0.0, 0.0], 0.0));
        assert_eq!(reading.behavior(), Behavior::Stop);
    }

    #[test]
    fn drift_is_what_was_not_asked_for() {
        let mut reading = Reading::default();
        (0..250).for_each(|_| reading.update([0.8, 0.0, 0.5], 0.6));
        assert!((reading.heading_drift() + 0.5).abs() < 1e-3);
        // A steady drift tends to that of ten seconds.
        (0..5000).for_each(|_| reading.update([0.8, 0.0, 0.5], 0.6));
        assert!((reading.heading_drift() + 1.0).abs() < 0.01);
        reading.forget_drift();
        assert_eq!(reading.heading_drift(), 0.0);
    }
}
