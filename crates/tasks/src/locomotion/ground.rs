//! The ground robots learn on.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use terrain::{GridConfig, SubTerrain, TerrainGrid};

use crate::bounds::within;

/// The ground robots learn on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, JsonSchema, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Terrain {
    /// Level ground.
    Flat,
    /// Stairs, boxes, roughness and slopes on ten levels, with the curriculum.
    Rough,
}

impl Terrain {
    /// Tiles of this ground, shaped by `seed`; `shares` are of the rough one.
    ///
    /// # Errors
    /// The terrain cannot be built.
    pub fn grid(self, shares: &TerrainShares, seed: u64) -> Result<TerrainGrid, String> {
        match self {
            Self::Flat => Ok(TerrainGrid::flat()),
            Self::Rough => {
                let config = GridConfig { seed, proportions: shares.proportions(), ..GridConfig::default() };
                TerrainGrid::new(&config).map_err(|error| error.to_string())
            }
        }
    }
}

/// How much of rough ground is of which kind, in parts of their sum; twenty columns of tiles are dealt out by them.
///
/// Defaults: Isaac Lab's `ROUGH_TERRAINS_CFG`.
#[derive(Clone, Debug, PartialEq, JsonSchema, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TerrainShares {
    /// Stairs that lead up to a plateau, where robots begin \[1; 0 to 1\]. Source: Isaac Lab, 0.2.
    pub stairs_up: f64,
    /// Stairs that lead down into a pit, where robots begin \[1; 0 to 1\]. Source: Isaac Lab, 0.2.
    pub stairs_down: f64,
    /// Boxes of random height \[1; 0 to 1\]. Source: Isaac Lab, 0.2.
    pub boxes: f64,
    /// Random heights, the same on all levels \[1; 0 to 1\]. Source: Isaac Lab, 0.2.
    pub random_rough: f64,
    /// Slopes up \[1; 0 to 1\]. Source: Isaac Lab, 0.1.
    pub slope_up: f64,
    /// Slopes down \[1; 0 to 1\]. Source: Isaac Lab, 0.1.
    pub slope_down: f64,
}

impl Default for TerrainShares {
    fn default() -> Self {
        Self {
            stairs_up: 0.2,
            stairs_down: 0.2,
            boxes: 0.2,
            random_rough: 0.2,
            slope_up: 0.1,
            slope_down: 0.1,
        }
    }
}

impl TerrainShares {
    /// Checks the values.
    ///
    /// # Errors
    /// Names the first one out of range, or says that none is above 0.
    pub fn validate(&self) -> Result<(), String> {
        within("stairs_up", self.stairs_up, 0.0, 1.0)?;
        within("stairs_down", self.stairs_down, 0.0, 1.0)?;
        within("boxes", self.boxes, 0.0, 1.0)?;
        within("random_rough", self.random_rough, 0.0, 1.0)?;
        within("slope_up", self.slope_up, 0.0, 1.0)?;
        within("slope_down", self.slope_down, 0.0, 1.0)?;
        if self.proportions().iter().all(|&(_, share)| share == 0.0) {
            return Err("terrain_shares are all 0, one must be above".to_owned());
        }
        Ok(())
    }

    fn proportions(&self) -> Vec<(SubTerrain, f64)> {
        vec![
            (SubTerrain::StairsUp, self.stairs_up),
            (SubTerrain::StairsDown, self.stairs_down),
            (SubTerrain::Boxes, self.boxes),
            (SubTerrain::RandomRough, self.random_rough),
            (SubTerrain::SlopeUp, self.slope_up),
            (SubTerrain::SlopeDown, self.slope_down),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_those_of_the_training_ground() {
        assert_eq!(TerrainShares::default().proportions(), GridConfig::default().proportions);
    }

    #[test]
    fn columns_are_dealt_out_by_the_shares() {
        let shares = TerrainShares { stairs_up: 0.0, boxes: 0.4, ..TerrainShares::default() };
        let grid = Terrain::Rough.grid(&shares, 3).unwrap();
        let columns = |kind| (0..grid.columns()).filter(|&column| grid.kind(0, column) == kind).count();
        assert_eq!([SubTerrain::StairsUp, SubTerrain::Boxes, SubTerrain::SlopeUp].map(columns), [0, 8, 2]);
    }

    #[test]
    fn shares_out_of_range_or_all_zero_are_refused() {
        let refused = |shares: TerrainShares| shares.validate().unwrap_err();
        assert_eq!(
            refused(TerrainShares { boxes: -0.5, ..TerrainShares::default() }),
            "boxes is -0.5, must be from 0 to 1"
        );
        let none = TerrainShares {
            stairs_up: 0.0,
            stairs_down: 0.0,
            boxes: 0.0,
            random_rough: 0.0,
            slope_up: 0.0,
            slope_down: 0.0,
        };
        assert_eq!(refused(none), "terrain_shares are all 0, one must be above");
    }
}
