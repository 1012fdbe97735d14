//! What is judged, and where.

use tasks::simulation::Randomization;

/// The ground of an evaluation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Ground {
    /// Level.
    #[default]
    Flat,
    /// All families, every tile of one level.
    Rough,
    /// Stairs up and down, every tile of one level.
    Stairs,
}

impl Ground {
    /// The name used in `results.json`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Flat => "flat",
            Self::Rough => "rough",
            Self::Stairs => "stairs",
        }
    }

    /// The level of its tiles if `asked` is asked for: flat ground has none but 0.
    pub fn level(self, asked: usize) -> usize {
        if self == Self::Flat { 0 } else { asked }
    }
}

/// What is to be judged, and where.
#[derive(Clone, Debug, Default)]
pub struct Setting {
    /// The ground.
    pub ground: Ground,
    /// Level of every tile, 0 to 9; not used on flat ground.
    pub level: usize,
    /// Robots, friction and harness drawn as in training, first states too; otherwise the nominal robot, standing.
    pub randomize: bool,
    /// Coulomb friction of every contact, where it is not to be that of the robots \[1\].
    pub friction: Option<f64>,
    /// Error of the force that supervisors see, along each axis, uniform, ±; drawn at every decision \[N\]. The oracle sees the
    /// force itself.
    pub force_noise_n: f64,
    /// Scale of the errors of all other sensors, for both networks; 1 is that of training, 0 none \[1\].
    pub sensor_noise: f64,
    /// Supervisors see the pulls, but none acts on the robot: what is left is what the walk itself lacks.
    pub unloaded: bool,
    /// Episodes of every case.
    pub episodes: usize,
    /// Tiles of rough ground or stairs to start on, up to 400, where they are not to be as many as episodes of a case.
    pub tiles: Option<usize>,
    /// Seed of all draws: the same for every supervisor, so that comparisons are paired.
    pub seed: u64,
}

/// The seed under which an evaluation draws robots, ground, pulls and noise: none of a training, whatever its seed below 2³², so that
/// nothing is judged on what it learned from.
pub fn draws(seed: u64) -> u64 {
    seed ^ (0x6a75_6467 << 32)
}

impl Setting {
    /// How robots differ from each other.
    pub(crate) fn randomization(&self) -> Randomization {
        let robots = if self.randomize { Randomization::default() } else { Randomization::none() };
        let friction = self.friction.map_or(robots.friction, |friction| [friction as f32; 2]);
        Randomization { friction, ..robots }
    }
}
