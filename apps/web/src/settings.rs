//! What a visitor can choose: the ground, the robot, who supervises, how many.

use serde::{Deserialize, Serialize};
use tasks::{bounds::within, simulation::Randomization};
use terrain::{SubTerrain, TerrainError, TerrainGrid};

/// Most robots of a herd.
pub const MAX_HERD: usize = 256;
/// Tiles along each axis of a ground: 48 m, and level ground around it.
const TILES: usize = 6;

/// The ground under the robots.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Ground {
    /// Level.
    Flat,
    /// Random heights.
    Rough,
    /// Slopes up to plateaus, 16 m apart.
    Slopes,
    /// Stairs up to plateaus; robots start above.
    Stairs,
    /// All families of the training ground.
    Mixed,
}

/// Who turns the pull into a velocity command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Mind {
    /// The network: the shipped one, or the visitor's own.
    Learned,
    /// Table II on the observed force.
    Rules,
    /// The dominance rule of Morlando et al.
    Dominance,
    /// Table II on the true force.
    Oracle,
}

/// The choices of a session. Field names are those of the page's links.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    /// The ground.
    pub ground: Ground,
    /// Its difficulty, 0 to 9; not used on level ground.
    pub level: usize,
    /// Seed of the ground's shape and of all noise.
    pub seed: u64,
    /// Who supervises: one lane for each, one or two.
    pub minds: Vec<Mind>,
    /// Robots in the first lane: 1, or a herd of up to [`MAX_HERD`], each drawn anew as in training but for the friction.
    pub robots: usize,
    /// Mass added to the base \[kg\]; not used in a herd.
    pub added_mass_kg: f32,
    /// Coulomb friction of all contacts.
    pub friction: f32,
    /// Length of the harness bar \[m\]; not used in a herd.
    pub bar_length_m: f32,
    /// Mass of the hand \[kg\]; not used in a herd.
    pub hand_mass_kg: f32,
    /// Error of the observed force along each axis, uniform, ± \[N\].
    pub force_noise_n: f32,
    /// Scale of the other sensors' errors; 1 is that of training.
    pub sensor_noise: f32,
}

impl Default for Settings {
    fn default() -> Self {
        let nominal = Randomization::none();
        Self {
            ground: Ground::Flat,
            level: 2,
            seed: 1,
            minds: vec![Mind::Learned],
            robots: 1,
            added_mass_kg: nominal.base_mass_kg[0],
            friction: nominal.friction[0],
            bar_length_m: nominal.bar_length_m[0],
            hand_mass_kg: nominal.hand_mass_kg[0],
            force_noise_n: 0.0,
            sensor_noise: 0.0,
        }
    }
}

impl Settings {
    /// Checks every value.
    ///
    /// # Errors
    /// Names the first one out of range, with what is allowed.
    pub fn validate(&self) -> Result<(), String> {
        within("level", self.level as f64, 0.0, (terrain::LEVELS - 1) as f64)?;
        within("the number of minds", self.minds.len() as f64, 1.0, 2.0)?;
        within("robots", self.robots as f64, 1.0, MAX_HERD as f64)?;
        if self.robots > 1 && self.minds.len() > 1 {
            return Err(format!("robots is {}, must be 1 beside a second mind", self.robots));
        }
        within("added_mass_kg", f64::from(self.added_mass_kg), -10.0, 20.0)?;
        within("friction", f64::from(self.friction), 0.1, 2.0)?;
        within("bar_length_m", f64::from(self.bar_length_m), 0.5, 1.2)?;
        within("hand_mass_kg", f64::from(self.hand_mass_kg), 0.1, 5.0)?;
        within("force_noise_n", f64::from(self.force_noise_n), 0.0, 20.0)?;
        within("sensor_noise", f64::from(self.sensor_noise), 0.0, 2.0)
    }

    /// The ground.
    ///
    /// # Errors
    /// The level is out of range.
    pub fn grid(&self) -> Result<TerrainGrid, TerrainError> {
        let kind = match self.ground {
            Ground::Flat => return Ok(TerrainGrid::flat()),
            Ground::Rough => Some(SubTerrain::RandomRough),
            Ground::Slopes => Some(SubTerrain::SlopeUp),
            Ground::Stairs => Some(SubTerrain::StairsUp),
            Ground::Mixed => None,
        };
        TerrainGrid::uniform(kind, self.level, self.seed, TILES)
    }

    /// Where the robots of these settings come from: one is as chosen, a herd is drawn as in training but has the friction chosen.
    pub fn randomization(&self) -> Randomization {
        let chosen = Randomization {
            base_mass_kg: [self.added_mass_kg; 2],
            friction: [self.friction; 2],
            bar_length_m: [self.bar_length_m; 2],
            hand_mass_kg: [self.hand_mass_kg; 2],
        };
        if self.robots == 1 {
            chosen
        } else {
            Randomization { friction: chosen.friction, ..Randomization::default() }
        }
    }

    /// Whether a session goes on when its settings become `other`: the ground and the robots stay the same.
    pub fn same_robots(&self, other: &Self) -> bool {
        let live = Self {
            minds: other.minds.clone(),
            force_noise_n: other.force_noise_n,
            sensor_noise: other.sensor_noise,
            ..self.clone()
        };
        self.minds.len() == other.minds.len() && live == *other
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_out_of_range_is_named() {
        Settings::default().validate().unwrap();
        let refusal = |settings: Settings| settings.validate().unwrap_err();
        assert!(refusal(Settings { level: 10, ..Settings::default() }).contains("level is 10"));
        assert!(refusal(Settings { friction: f32::NAN, ..Settings::default() }).contains("friction is NaN"));
        assert!(refusal(Settings { minds: vec![], ..Settings::default() }).contains("minds is 0"));
        let crowd = Settings { robots: 64, minds: vec![Mind::Learned, Mind::Rules], ..Settings::default() };
        assert!(refusal(crowd).contains("robots is 64"));
    }

    #[test]
    fn minds_and_noise_change_in_mid_walk_and_nothing_else_does() {
        let now = Settings::default();
        assert!(now.same_robots(&Settings { minds: vec![Mind::Rules], force_noise_n: 2.0, ..now.clone() }));
        assert!(!now.same_robots(&Settings { minds: vec![Mind::Rules; 2], ..now.clone() }));
        assert!(!now.same_robots(&Settings { friction: 0.5, ..now.clone() }));
    }

    #[test]
    fn every_ground_can_be_built() {
        for ground in [Ground::Flat, Ground::Rough, Ground::Slopes, Ground::Stairs, Ground::Mixed] {
            for level in [0, 9] {
                Settings { ground, level, ..Settings::default() }.grid().unwrap();
            }
        }
    }
}
