//! What a scripted hand does over an episode.

use spatial::{Philox, Purpose};

/// Lowest and highest frequency of the noise on a force \[Hz\]: a hand's tremor of walking.
const NOISE_HZ: [f32; 2] = [0.5, 3.0];
/// Waves that make the noise of an axis.
const WAVES: usize = 3;

/// How a pull comes about; the force it leads to is the case's own.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Script {
    /// The force from the beginning.
    #[default]
    Steady,
    /// With a noise of 0.5 to 3 Hz of at most `amplitude_n` \[N\] on both horizontal axes.
    Noisy {
        /// Largest deviation of an axis \[N\].
        amplitude_n: f32,
    },
    /// From another force, linearly.
    Ramp {
        /// At the beginning \[N\].
        from: [f32; 3],
        /// How long it takes \[s\].
        over_s: f64,
    },
    /// Another force for a while, then at once the case's own: a tug, or a change of mind.
    After {
        /// At the beginning \[N\].
        first: [f32; 3],
        /// How long it lasts \[s\].
        for_s: f64,
    },
    /// Swinging about the force, as a hand does that follows the gait.
    Swinging {
        /// Amplitude of each axis \[N\].
        by: [f32; 3],
        /// Swings a second.
        hertz: f32,
    },
}

impl Script {
    /// When the case's own force is reached \[s\]: what is judged begins to count from there.
    pub fn settles_s(&self) -> f64 {
        match *self {
            Self::Steady | Self::Noisy { .. } | Self::Swinging { .. } => 0.0,
            Self::Ramp { over_s, .. } => over_s,
            Self::After { for_s, .. } => for_s,
        }
    }

    /// The force before, if it was held: the change to the case's own is sudden then, and reactions to it can be timed.
    pub fn before(&self) -> Option<[f32; 3]> {
        match *self {
            Self::Ramp { .. } => None,
            Self::After { first, .. } => Some(first),
            Self::Steady | Self::Noisy { .. } | Self::Swinging { .. } => Some([0.0; 3]),
        }
    }

    /// The forces \[N\] between which it leads, beside the case's own, `force`; noise is not meant, and not among them.
    pub fn extremes(&self, force: [f32; 3]) -> Vec<[f32; 3]> {
        match *self {
            Self::Steady | Self::Noisy { .. } => vec![],
            Self::Ramp { from, .. } => vec![from],
            Self::After { first, .. } => vec![first],
            Self::Swinging { by, .. } => {
                [-1.0, 1.0].map(|sign| std::array::from_fn(|axis| force[axis] + sign * by[axis])).to_vec()
            }
        }
    }

    /// The force \[N\] at a time \[s\] since the pull began; `force` is the case's own, `noise` belongs to the robot.
    pub fn force(&self, force: [f32; 3], time_s: f64, noise: &Noise) -> [f32; 3] {
        let time = time_s as f32;
        match *self {
            Self::Steady => force,
            Self::Noisy { amplitude_n } => {
                let [x, y] = noise.at(time).map(|wave| amplitude_n * wave);
                [force[0] + x, force[1] + y, force[2]]
            }
            Self::Ramp { from, over_s } => {
                let share = (time_s / over_s).min(1.0) as f32;
                std::array::from_fn(|axis| from[axis] + share * (force[axis] - from[axis]))
            }
            // Half a step of tolerance, so that rounding never decides.
            Self::After { first, for_s } => {
                if time_s < for_s - 0.01 {
                    first
                } else {
                    force
                }
            }
            Self::Swinging { by, hertz } => {
                let wave = (std::f32::consts::TAU * hertz * time).sin();
                std::array::from_fn(|axis| force[axis] + wave * by[axis])
            }
        }
    }
}

/// Noise of one robot's hand along x and y, within ±1.
#[derive(Clone, Copy, Debug)]
pub struct Noise {
    /// Frequency \[Hz\] and phase of each wave of each axis.
    waves: [[[f32; 2]; WAVES]; 2],
}

impl Noise {
    /// Draws the noise of a robot.
    pub fn new(seed: u64, robot: usize) -> Self {
        let mut random = Philox::new(seed, robot, 0, 0, Purpose::Evaluation);
        let mut wave =
            || [random.uniform(NOISE_HZ[0], NOISE_HZ[1]), random.uniform(0.0, std::f32::consts::TAU)];
        Self { waves: std::array::from_fn(|_| std::array::from_fn(|_| wave())) }
    }

    fn at(&self, time_s: f32) -> [f32; 2] {
        self.waves.map(|axis| {
            let wave = |[hertz, phase]: [f32; 2]| (std::f32::consts::TAU * hertz * time_s + phase).sin();
            axis.into_iter().map(wave).sum::<f32>() / WAVES as f32
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FORCE: [f32; 3] = [-60.0, 20.0, 0.0];

    fn at(script: Script, time_s: f64) -> [f32; 3] {
        script.force(FORCE, time_s, &Noise::new(1, 0))
    }

    #[test]
    fn every_script_leads_to_the_force_of_the_case() {
        let ramp = Script::Ramp { from: [20.0, 0.0, 0.0], over_s: 2.0 };
        assert_eq!(at(ramp, 0.0), [20.0, 0.0, 0.0]);
        assert_eq!(at(ramp, 1.0), [-20.0, 10.0, 0.0]);
        let tug = Script::After { first: [0.0, 40.0, 0.0], for_s: 0.5 };
        assert_eq!(at(tug, 0.48), [0.0, 40.0, 0.0]);
        assert_eq!(at(tug, 0.5), FORCE);
        for script in [Script::Steady, ramp, tug] {
            assert_eq!(at(script, script.settles_s()), FORCE);
            assert_eq!(at(script, 12.0), FORCE);
        }
        let swinging = Script::Swinging { by: [10.0, 0.0, 0.0], hertz: 0.5 };
        let [x, y, _] = at(swinging, 0.5);
        assert!((x + 50.0).abs() < 1e-4 && y == 20.0);
    }

    #[test]
    fn noise_stays_within_its_amplitude_averages_out_and_differs_between_robots() {
        let script = Script::Noisy { amplitude_n: 2.0 };
        let deviation = |robot: usize, step: i32| {
            let [x, y, _] = script.force(FORCE, f64::from(step) * 0.02, &Noise::new(1, robot));
            [x - FORCE[0], y - FORCE[1]]
        };
        let all: Vec<[f32; 2]> = (0..100).flat_map(|r| (0..600).map(move |s| deviation(r, s))).collect();
        assert!(all.iter().flatten().all(|d| d.abs() <= 2.0));
        for axis in 0..2 {
            let mean = all.iter().map(|d| d[axis]).sum::<f32>() / all.len() as f32;
            let square = all.iter().map(|d| d[axis] * d[axis]).sum::<f32>() / all.len() as f32;
            // Three waves of two thirds of a newton each: their squares' means are 2/9 each.
            assert!(mean.abs() < 0.05 && (square - 2.0 / 3.0).abs() < 0.05, "{mean} {square}");
        }
        assert_ne!(deviation(0, 7), deviation(1, 7));
    }
}
