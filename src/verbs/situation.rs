//! Who walks where: the arguments that `evaluate` and `picture` share.

use anyhow::Result;
use clap::{Args, ValueEnum};
use guidedog::error::BadInput;
use guidedog::evaluation::judge::{Arena, Ground, Setting};
use guidedog::judging::LEVEL;
use guidedog::policies::{self, SHIPPED};

#[derive(Debug, Args)]
pub(crate) struct Situation {
    /// The locomotion policy, an ONNX file
    #[arg(long, default_value = SHIPPED)]
    pub(crate) locomotion: String,
    /// The supervisor: an ONNX file, rules (Table II), rules-margin (with thresholds 2 N farther out), dominance or oracle
    #[arg(long, default_value = SHIPPED)]
    pub(crate) supervisor: String,
    /// The ground [default: flat]
    #[arg(long, value_enum)]
    pub(crate) ground: Option<GroundName>,
    /// Level of every tile of rough ground or stairs, 0 to 9 [default: 5]
    #[arg(long, requires = "ground", value_parser = clap::value_parser!(u64).range(0..=9))]
    pub(crate) level: Option<u64>,
    /// Seed of all draws
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum GroundName {
    Flat,
    Rough,
    Stairs,
}

impl From<GroundName> for Ground {
    fn from(name: GroundName) -> Self {
        match name {
            GroundName::Flat => Self::Flat,
            GroundName::Rough => Self::Rough,
            GroundName::Stairs => Self::Stairs,
        }
    }
}

impl Situation {
    /// The ground, with the policy that walks there.
    pub(crate) fn arena(&self, episodes: usize) -> Result<Arena> {
        self.arena_with(Setting { episodes, ..Setting::default() })
    }

    /// As [`Self::arena`], ground and seed of `setting` aside.
    pub(crate) fn arena_with(&self, setting: Setting) -> Result<Arena> {
        let ground = self.ground.map_or(Ground::Flat, Ground::from);
        let level = ground.level(self.level.map_or(LEVEL, |level| level as usize));
        let setting = Setting { ground, level, seed: self.seed, ..setting };
        Ok(Arena::new(policies::locomotion(&self.locomotion)?, setting).map_err(BadInput::new)?)
    }
}
