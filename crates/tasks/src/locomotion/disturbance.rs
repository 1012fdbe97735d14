//! Forces that push the robot while it learns to walk: at its base, and at the hand behind it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spatial::Philox;

use crate::bounds::{ordered_within, within};

/// How disturbances are drawn.
///
/// A hand 1.2 m behind the base turns the robot against the pull, and no policy trained without such forces withstood them.
#[derive(Clone, Debug, PartialEq, JsonSchema, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DisturbanceConfig {
    /// Strength of all disturbances \[1; 0 to 1\]. Source: ours.
    pub strength: f32,
    /// Control steps over which the strength grows from 0; only those count during which robots walk as told (`ramp_tracking`
    /// of the task) \[steps; 0 to 4294967295\]. Source: docs/findings.md, "Disturbances before walking".
    pub ramp_steps: u32,
    /// Force on the base along each axis, ± \[N; 0 to 1000\]. Source: the paper, 100.
    pub base_force_n: f32,
    /// Force at the hand along x, from and to \[N; -1000 to 1000\]. Source: the paper, −80 to 0 in training and −100 in its
    /// cases; pushes are ours.
    pub hand_force_x_n: [f32; 2],
    /// Force at the hand along y, ± \[N; 0 to 1000\]. Source: the paper, 40 in training and 50 in its cases.
    pub hand_force_y_n: f32,
    /// Force at the hand along z, ± \[N; 0 to 1000\]. Source: the paper, 20; twice that is ours.
    pub hand_force_z_n: f32,
    /// Share of disturbances on the base; the shares add up to at most 1 \[1; 0 to 1\]. Source: ours.
    pub base_share: f32,
    /// Share of disturbances at the hand; what is left over is rest \[1; 0 to 1\]. Source: ours.
    pub hand_share: f32,
    /// Share of the forces at the hand that are meant: while they last robots are told to do what Table II says of them, as a
    /// supervisor will tell them. Commands drawn by themselves hardly ever say to stop just when a strong pull back sets in. They
    /// are also told while forces have yet to grow from 0 (`ramp_steps`): what hardly pulls says to walk \[1; 0 to 1\]. Source:
    /// docs/findings.md, "Pulls that are meant"; the paper: 0.
    pub meant_share: f32,
    /// How long a force lasts, from and to \[s; 0.02 to 1000\]. Source: ours, from a tug to a pull as long as the paper's.
    pub duration_s: [f32; 2],
    /// Time from one beginning to the next, from and to \[s; 0.02 to 1000\]. Source: ours.
    pub period_s: [f32; 2],
}

impl Default for DisturbanceConfig {
    fn default() -> Self {
        Self {
            strength: 1.0,
            ramp_steps: 8_000,
            base_force_n: 100.0,
            hand_force_x_n: [-100.0, 60.0],
            hand_force_y_n: 60.0,
            hand_force_z_n: 40.0,
            base_share: 0.2,
            hand_share: 0.55,
            meant_share: 0.0,
            duration_s: [0.25, 5.0],
            period_s: [3.0, 8.0],
        }
    }
}

/// A force and how long it lasts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disturbance {
    /// On the base, heading frame \[N\].
    pub base_force: [f32; 3],
    /// At the hand, heading frame \[N\].
    pub hand_force: [f32; 3],
    /// Whether the force at the hand says what to do.
    pub meant: bool,
    /// How long \[s\].
    pub duration_s: f32,
    /// When the next begins \[s\].
    pub period_s: f32,
}

impl DisturbanceConfig {
    /// Checks the values.
    ///
    /// # Errors
    /// Names the first one out of range.
    pub fn validate(&self) -> Result<(), String> {
        within("disturbance.strength", self.strength, 0.0, 1.0)?;
        within("disturbance.base_force_n", self.base_force_n, 0.0, 1000.0)?;
        within("disturbance.hand_force_y_n", self.hand_force_y_n, 0.0, 1000.0)?;
        within("disturbance.hand_force_z_n", self.hand_force_z_n, 0.0, 1000.0)?;
        within("disturbance.base_share", self.base_share, 0.0, 1.0)?;
        within("disturbance.hand_share", self.hand_share, 0.0, 1.0)?;
        let shares = self.base_share + self.hand_share;
        if shares > 1.0 {
            return Err(format!(
                "disturbance.base_share and hand_share are {} and {}, which add up to {shares}, must be at most 1 together",
                self.base_share, self.hand_share
            ));
        }
        within("disturbance.meant_share", self.meant_share, 0.0, 1.0)?;
        ordered_within("disturbance.hand_force_x_n", self.hand_force_x_n, -1000.0, 1000.0)?;
        ordered_within("disturbance.duration_s", self.duration_s, 0.02, 1000.0)?;
        ordered_within("disturbance.period_s", self.period_s, 0.02, 1000.0)
    }

    /// Draws a force; `progress` from 0 to 1 scales it.
    pub fn draw(&self, progress: f32, random: &mut Philox) -> Disturbance {
        let strength = self.strength * progress;
        let kind = random.uniform01();
        let mut draw = |[low, high]: [f32; 2]| random.uniform(low, high);
        let symmetric = |width: f32| [-width, width];
        let base = [0; 3].map(|_| strength * draw(symmetric(self.base_force_n)));
        let hand = [self.hand_force_x_n, symmetric(self.hand_force_y_n), symmetric(self.hand_force_z_n)]
            .map(|range| strength * draw(range));
        let (duration_s, period_s) = (draw(self.duration_s), draw(self.period_s));
        let on_base = kind < self.base_share;
        let at_hand = !on_base && kind < self.base_share + self.hand_share;
        Disturbance {
            base_force: if on_base { base } else { [0.0; 3] },
            hand_force: if at_hand { hand } else { [0.0; 3] },
            meant: at_hand && random.uniform01() < self.meant_share,
            duration_s,
            period_s,
        }
    }
}

#[cfg(test)]
mod tests {
    use spatial::Purpose;

    use super::*;

    #[test]
    fn shares_that_fill_one_are_allowed_and_no_more() {
        let shares = |base_share, hand_share| {
            DisturbanceConfig { base_share, hand_share, ..DisturbanceConfig::default() }.validate()
        };
        for (base, hand) in [(0.6, 0.4), (0.8, 0.2), (0.0, 1.0), (1.0, 0.0)] {
            assert_eq!(shares(base, hand), Ok(()), "{base} and {hand}");
        }
        let message = shares(0.75, 0.5).unwrap_err();
        assert!(
            message.contains("hand_share are 0.75 and 0.5, which add up to 1.25, must be at most 1"),
            "{message}"
        );
    }

    #[test]
    fn forces_stay_in_their_ranges_and_shares() {
        let config = DisturbanceConfig::default();
        let mut random = Philox::new(1, 0, 0, 0, Purpose::Disturbance);
        let drawn: Vec<_> = (0..10_000).map(|_| config.draw(1.0, &mut random)).collect();
        let share = |test: &dyn Fn(&Disturbance) -> bool| {
            drawn.iter().filter(|d| test(d)).count() as f32 / drawn.len() as f32
        };
        assert!((share(&|d| d.base_force != [0.0; 3]) - 0.2).abs() < 0.02);
        assert!((share(&|d| d.hand_force != [0.0; 3]) - 0.55).abs() < 0.02);
        for d in &drawn {
            let [x, y, z] = d.hand_force;
            assert!((-100.0..=60.0).contains(&x) && y.abs() <= 60.0 && z.abs() <= 40.0);
            assert!(d.base_force.iter().all(|f| f.abs() <= 100.0));
            assert!((0.25..=5.0).contains(&d.duration_s) && (3.0..=8.0).contains(&d.period_s));
        }
        assert!(share(&|d| d.hand_force[1] > 50.0) > 0.03);
        assert!(drawn.iter().all(|d| !d.meant), "unless asked for");
        let meant = DisturbanceConfig { meant_share: 0.5, ..config.clone() };
        let meant: Vec<_> = (0..10_000).map(|_| meant.draw(1.0, &mut random)).filter(|d| d.meant).collect();
        assert!(meant.iter().all(|d| d.hand_force != [0.0; 3]));
        assert!((meant.len() as f32 / 10_000.0 - 0.275).abs() < 0.02, "{}", meant.len());
        let halved = config.draw(0.5, &mut Philox::new(1, 0, 0, 0, Purpose::Disturbance));
        assert!(halved.hand_force[0].abs() <= 50.0);
    }
}
