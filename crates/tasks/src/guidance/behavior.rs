//! What a pull means: Table II of the paper, and Table I's reward for obeying it.

use serde::{Deserialize, Serialize};

/// What the handler means by a pull: the four labels of Table II.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Behavior {
    /// Straight ahead at the guiding speed.
    #[default]
    Walk,
    /// Stand still.
    Stop,
    /// Ahead and around.
    Turn,
    /// Around on the spot.
    Spin,
}

/// A pull back of more than this means not to go on \[N\]. Source: the paper, Table II.
pub const PULL_THRESHOLD_X_N: f32 = 40.0;
/// A sideways pull of more than this means to turn \[N\]. Source: the paper, Table II.
pub const PULL_THRESHOLD_Y_N: f32 = 20.0;
/// Speed of walking and turning \[m/s\]. Source: the paper, Table II.
pub const GUIDING_SPEED_MPS: f32 = 0.8;
/// Yaw rate per newton of sideways pull \[rad/s/N\]. Source: the paper, Table II.
pub const YAW_RATE_PER_NEWTON: f32 = 0.02;

impl Behavior {
    /// All behaviors, in the order of tables and legends.
    pub const ALL: [Self; 4] = [Self::Walk, Self::Stop, Self::Turn, Self::Spin];

    /// Table II's label of a force \[N\], heading frame. At a threshold the gentler reading holds: (−40, ±20) is walk.
    pub fn of_force(force: [f32; 3]) -> Self {
        Self::of_force_with_margin(force, [0.0; 2])
    }

    /// The same with thresholds along x and y that are higher by `margin` \[N\].
    pub fn of_force_with_margin(force: [f32; 3], margin: [f32; 2]) -> Self {
        let back = force[0] < -PULL_THRESHOLD_X_N - margin[0];
        let sideways = force[1].abs() > PULL_THRESHOLD_Y_N + margin[1];
        match (back, sideways) {
            (false, false) => Self::Walk,
            (true, false) => Self::Stop,
            (false, true) => Self::Turn,
            (true, true) => Self::Spin,
        }
    }

    /// The name used in files and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Walk => "walk",
            Self::Stop => "stop",
            Self::Turn => "turn",
            Self::Spin => "spin",
        }
    }

    /// Whether the handler wants to stay in place.
    pub fn stays(self) -> bool {
        matches!(self, Self::Stop | Self::Spin)
    }

    /// Table II's velocities under a force: v_x, v_y \[m/s\], ω_z \[rad/s\].
    pub fn target(self, force: [f32; 3]) -> [f32; 3] {
        let around = matches!(self, Self::Turn | Self::Spin);
        let speed = if self.stays() { 0.0 } else { GUIDING_SPEED_MPS };
        let yaw_rate = if around { YAW_RATE_PER_NEWTON * force[1] } else { 0.0 };
        [speed, 0.0, yaw_rate]
    }
}

/// The paper's mean behavior reward in training, with exploration noise, after 3000 iterations.
pub const PAPER_TOTAL: f64 = 0.61;

impl Behavior {
    /// The paper's share of this behavior in training, read from its text; the four add up to 0.59, not to the total.
    pub const fn paper_share(self) -> f64 {
        match self {
            Self::Walk => 0.13,
            Self::Stop => 0.22,
            Self::Turn => 0.08,
            Self::Spin => 0.16,
        }
    }
}

impl std::fmt::Display for Behavior {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.pad(self.name())
    }
}

/// The paper's Table I: exp(−10 |target − velocity|²), velocities as v_x, v_y \[m/s\], ω_z \[rad/s\].
pub fn behavior_reward(target: [f32; 3], velocity: [f32; 3]) -> f32 {
    let square: f32 = target.iter().zip(velocity).map(|(t, v)| (t - v) * (t - v)).sum();
    (-10.0 * square).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_two_on_just_under_and_just_over_both_thresholds() {
        use Behavior::{Spin, Stop, Turn, Walk};
        let table = [
            (-40.0, 20.0, Walk),
            (-40.1, 20.0, Stop),
            (-40.0, 20.1, Turn),
            (-40.1, 20.1, Spin),
            (-39.9, 19.9, Walk),
            (0.0, 0.0, Walk),
            (20.0, 0.0, Walk),
            (-100.0, 0.0, Stop),
            (20.0, 50.0, Turn),
        ];
        for (fx, fy, expected) in table {
            for side in [1.0, -1.0] {
                assert_eq!(Behavior::of_force([fx, side * fy, 7.0]), expected, "{fx}/{}", side * fy);
            }
        }
    }

    #[test]
    fn each_margin_moves_its_own_threshold() {
        use Behavior::{Spin, Stop, Turn, Walk};
        for (fx, fy, expected) in
            [(-41.0, 20.5, Walk), (-41.1, 20.5, Stop), (-41.0, 20.6, Turn), (-41.1, -20.6, Spin)]
        {
            assert_eq!(Behavior::of_force_with_margin([fx, fy, 0.0], [1.0, 0.5]), expected, "{fx}/{fy}");
        }
    }

    #[test]
    fn targets_by_hand() {
        let target = |fx, fy| {
            let force = [fx, fy, 0.0];
            Behavior::of_force(force).target(force)
        };
        assert_eq!(target(0.0, 15.0), [0.8, 0.0, 0.0]);
        assert_eq!(target(-60.0, 15.0), [0.0; 3]);
        assert_eq!(target(-20.0, -25.0), [0.8, 0.0, -0.5]);
        assert_eq!(target(-60.0, 50.0), [0.0, 0.0, 1.0]);
    }

    #[test]
    fn reward_by_hand() {
        assert_eq!(behavior_reward([0.8, 0.0, 0.6], [0.8, 0.0, 0.6]), 1.0);
        let off = behavior_reward([0.8, 0.0, 0.0], [0.7, 0.1, -0.2]);
        assert!((off - (-0.6_f32).exp()).abs() < 1e-6);
        // Table II of the reference: walk read as stop keeps 0.0017.
        assert!((behavior_reward([0.8, 0.0, 0.0], [0.0; 3]) - 0.00166).abs() < 1e-5);
    }
}
