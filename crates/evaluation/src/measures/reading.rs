//! What a handler would take a motion for: the behavior of Table II that it is nearest to.

use serde::{Deserialize, Serialize};
use tasks::guidance::{Behavior, GUIDING_SPEED_MPS, PULL_THRESHOLD_Y_N, YAW_RATE_PER_NEWTON};

/// The behavior nearest to a mean velocity (v_x, v_y \[m/s\], ω_z \[rad/s\]) under a sideways force \[N\].
///
/// The four prototypes are the corners of a rectangle, 0.8 m/s by 0.02 |f_y| rad/s (at least the 0.4 rad/s of Table II's own
/// threshold) to the force's side, so that being nearest, in the metric of the behavior reward, splits into two
/// questions: faster than half of the speed, and turning faster than half of the rate? Without a sideways force a turn to
/// either side counts.
pub fn nearest(velocity: [f64; 3], force_y: f64) -> Behavior {
    let least = f64::from(PULL_THRESHOLD_Y_N);
    let rate = f64::from(YAW_RATE_PER_NEWTON) * force_y.abs().max(least);
    let around = if force_y == 0.0 { velocity[2].abs() } else { velocity[2] * force_y.signum() };
    let forward = velocity[0] > 0.5 * f64::from(GUIDING_SPEED_MPS);
    match (forward, around > 0.5 * rate) {
        (true, false) => Behavior::Walk,
        (false, false) => Behavior::Stop,
        (true, true) => Behavior::Turn,
        (false, true) => Behavior::Spin,
    }
}

/// Episodes by the behavior they looked like; fallen robots looked like none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Readings {
    /// Looked like walking straight.
    pub walk: usize,
    /// Like standing.
    pub stop: usize,
    /// Like a turn.
    pub turn: usize,
    /// Like turning on the spot.
    pub spin: usize,
}

impl Readings {
    /// Counts an episode.
    pub fn count(&mut self, behavior: Behavior) {
        *self.of_mut(behavior) += 1;
    }

    /// Adds the counts of others.
    pub fn add(&mut self, others: &Self) {
        Behavior::ALL.into_iter().for_each(|behavior| *self.of_mut(behavior) += others.of(behavior));
    }

    /// How many looked like this.
    pub fn of(&self, behavior: Behavior) -> usize {
        match behavior {
            Behavior::Walk => self.walk,
            Behavior::Stop => self.stop,
            Behavior::Turn => self.turn,
            Behavior::Spin => self.spin,
        }
    }

    fn of_mut(&mut self, behavior: Behavior) -> &mut usize {
        match behavior {
            Behavior::Walk => &mut self.walk,
            Behavior::Stop => &mut self.stop,
            Behavior::Turn => &mut self.turn,
            Behavior::Spin => &mut self.spin,
        }
    }

    /// All of them.
    pub fn total(&self) -> usize {
        Behavior::ALL.into_iter().map(|behavior| self.of(behavior)).sum()
    }
}

/// Rows: what Table II makes of the force. Columns: what the motion looked like.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Confusion {
    /// Forces that mean to walk.
    pub walk: Readings,
    /// To stop.
    pub stop: Readings,
    /// To turn.
    pub turn: Readings,
    /// To spin.
    pub spin: Readings,
}

impl Confusion {
    /// Adds the episodes of forces that mean `behavior`.
    pub fn add(&mut self, behavior: Behavior, readings: &Readings) {
        match behavior {
            Behavior::Walk => self.walk.add(readings),
            Behavior::Stop => self.stop.add(readings),
            Behavior::Turn => self.turn.add(readings),
            Behavior::Spin => self.spin.add(readings),
        }
    }

    /// The row of a behavior.
    pub fn row(&self, behavior: Behavior) -> &Readings {
        match behavior {
            Behavior::Walk => &self.walk,
            Behavior::Stop => &self.stop,
            Behavior::Turn => &self.turn,
            Behavior::Spin => &self.spin,
        }
    }
}

#[cfg(test)]
mod tests {
    use tasks::guidance::behavior_reward;

    use super::*;

    #[test]
    fn motions_by_hand() {
        use Behavior::{Spin, Stop, Turn, Walk};
        for (velocity, force_y, expected) in [
            ([0.8, 0.0, 0.0], 0.0, Walk),
            ([0.41, 0.0, 0.19], 0.0, Walk),
            ([0.39, 0.0, 0.0], 10.0, Stop),
            ([0.8, 0.0, 0.21], 0.0, Turn),
            ([0.8, 0.0, -0.21], 0.0, Turn),
            // Half of the yaw rate asked for at 50 N.
            ([0.8, 0.0, 0.49], 50.0, Walk),
            ([0.8, 0.0, 0.51], 50.0, Turn),
            // Turning the wrong way is not understanding a turn.
            ([0.8, 0.0, -0.6], 30.0, Walk),
            ([0.0, 0.0, -0.6], -30.0, Spin),
        ] {
            assert_eq!(nearest(velocity, force_y), expected, "{velocity:?} under {force_y}");
        }
    }

    #[test]
    fn nearest_is_what_the_behavior_reward_prefers() {
        for fy in [-50.0_f32, -25.0, 25.0, 40.0] {
            for (x, w) in
                (0..20).flat_map(|i| (0..20).map(move |k| (i as f32 * 0.06 - 0.1, k as f32 * 0.11 - 1.05)))
            {
                let score =
                    |behavior: Behavior| behavior_reward(behavior.target([0.0, fy, 0.0]), [x, 0.0, w]);
                let best = Behavior::ALL.into_iter().max_by(|a, b| score(*a).total_cmp(&score(*b))).unwrap();
                let found = nearest([f64::from(x), 0.0, f64::from(w)], f64::from(fy));
                assert!(score(found) >= score(best) - 1e-6, "{x} {w} under {fy}: {found}, {best}");
            }
        }
    }

    #[test]
    fn counts_go_to_their_rows_and_columns() {
        let mut readings = Readings::default();
        readings.count(Behavior::Turn);
        readings.count(Behavior::Turn);
        readings.count(Behavior::Walk);
        let mut confusion = Confusion::default();
        confusion.add(Behavior::Spin, &readings);
        confusion.add(Behavior::Spin, &readings);
        assert_eq!((confusion.spin.turn, confusion.spin.walk, confusion.spin.spin), (4, 2, 0));
        assert_eq!((confusion.row(Behavior::Spin).total(), confusion.row(Behavior::Walk).total()), (6, 0));
    }
}
