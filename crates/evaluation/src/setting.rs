//! What is judged, and where.

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
    /// Error of the force that supervisors see, along each axis, uniform, ±; drawn at every decision \[N\]. The oracle sees the
    /// force itself.
    pub force_noise_n: f64,
    /// Episodes of every case.
    pub episodes: usize,
    /// Seed of all draws: the same for every supervisor, so that comparisons are paired.
    pub seed: u64,
}
