//! The ground of a whole training or evaluation: tiles side by side, level border around.
//!
//! World x runs along the levels and y along the columns, as in Isaac Lab (`terrains/terrain_generator.py`); the
//! field is centered on the world's origin.

use std::sync::Arc;

use spatial::{Philox, Purpose};

use crate::height_field::HeightField;
use crate::sub_terrain::SubTerrain;
use crate::tile::{CELL_SIZE_M, TILE_CELLS, TILE_SIZE_M, TileCells};

/// Levels of difficulty in the reference curriculum; [`TerrainGrid::uniform`] counts in these.
pub const LEVELS: usize = 10;

/// Most tiles along an axis.
const MAX_TILES: usize = 100;
/// Most cells, counting the rim of one that physics lays around them: their indices must be exact in single precision. At
/// 16 bytes each they are 0.27 GB, and what physics makes of them, at 76 bytes each, 1.28 GB beside.
const MAX_CELLS: usize = (1 << 24) - 1;
/// Widest border \[m\].
const MAX_BORDER_M: f64 = 100.0;

/// Layout of the training ground; the default is Isaac Lab's `ROUGH_TERRAINS_CFG`. Its cells, the border's and a rim of
/// one around them included, are fewer than 2²⁴.
#[derive(Clone, Debug, PartialEq)]
pub struct GridConfig {
    /// Rows of tiles of growing difficulty, 1 to 100; default 10.
    pub levels: usize,
    /// Columns of tiles, each of one family, 1 to 100; default 20.
    pub columns: usize,
    /// Width of the level ground around the tiles \[m\], 0 to 100; default 20. Beyond it the ground goes on level.
    pub border_m: f64,
    /// Families and their shares of the columns, in the order of the columns; need not sum to 1.
    pub proportions: Vec<(SubTerrain, f64)>,
    /// Seed of the shapes.
    pub seed: u64,
}

impl Default for GridConfig {
    fn default() -> Self {
        let proportions = vec![
            (SubTerrain::StairsUp, 0.2),
            (SubTerrain::StairsDown, 0.2),
            (SubTerrain::Boxes, 0.2),
            (SubTerrain::RandomRough, 0.2),
            (SubTerrain::SlopeUp, 0.1),
            (SubTerrain::SlopeDown, 0.1),
        ];
        Self { levels: LEVELS, columns: 20, border_m: 20.0, proportions, seed: 0 }
    }
}

/// A layout that cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TerrainError {
    /// A size outside its bounds.
    #[error("terrain {name} is {value}; allowed: {low} to {high}")]
    Size {
        /// Which one.
        name: &'static str,
        /// What was asked for.
        value: f64,
        /// Least allowed.
        low: f64,
        /// Greatest allowed.
        high: f64,
    },
    /// More cells than can be told apart.
    #[error(
        "the terrain has {cells} cells with its border and a rim of one; allowed: up to {most}, as their indices must be exact in single precision",
        most = MAX_CELLS
    )]
    Cells {
        /// How many.
        cells: usize,
    },
    /// A share that is negative or not finite.
    #[error("the share of {kind:?} is {share}; allowed: finite, 0 or more")]
    Share {
        /// The family.
        kind: SubTerrain,
        /// What was asked for.
        share: f64,
    },
    /// No family has a share.
    #[error("the shares of the terrain's families sum to 0; allowed: at least one above 0")]
    NoShare,
}

/// What became of a tile.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Tile {
    kind: SubTerrain,
    difficulty: f64,
    spawn_w: [f32; 3],
}

/// Tiles in rows of levels along x and columns along y, and the ground they make.
#[derive(Clone, Debug, PartialEq)]
pub struct TerrainGrid {
    /// The ground, world frame.
    pub field: Arc<HeightField>,
    levels: usize,
    columns: usize,
    /// `tiles[level * columns + column]`.
    tiles: Vec<Tile>,
}

impl TerrainGrid {
    /// The training ground: difficulty grows with the level, the family depends on the column.
    ///
    /// The difficulty of level r is drawn from \[r, r + 1) / levels.
    ///
    /// # Errors
    /// A size or share outside its bounds, or too many cells.
    pub fn new(config: &GridConfig) -> Result<Self, TerrainError> {
        check_size("levels", config.levels as f64, 1.0, MAX_TILES as f64)?;
        check_size("columns", config.columns as f64, 1.0, MAX_TILES as f64)?;
        check_size("border_m", config.border_m, 0.0, MAX_BORDER_M)?;
        check_cells(config)?;
        let total = total_share(&config.proportions)?;
        Ok(Self::build(config, |level, column, random| {
            // The middle of the column, so that rounding never decides.
            let share = (column as f64 + 0.5) / config.columns as f64 * total;
            let difficulty = (level as f64 + f64::from(random.uniform01())) / config.levels as f64;
            (family_at(&config.proportions, share), difficulty)
        }))
    }

    /// Ground for evaluation, `size` × `size` tiles, all of one `level` of [`LEVELS`]: of one family, or of all of
    /// them, drawn tile by tile by the default shares.
    ///
    /// # Errors
    /// `level` above 9, `size` not within 1 to 100 or, from 47 on, too many cells.
    pub fn uniform(
        kind: Option<SubTerrain>,
        level: usize,
        seed: u64,
        size: usize,
    ) -> Result<Self, TerrainError> {
        check_size("level", level as f64, 0.0, (LEVELS - 1) as f64)?;
        check_size("size", size as f64, 1.0, MAX_TILES as f64)?;
        let config = GridConfig { levels: size, columns: size, seed, ..GridConfig::default() };
        check_cells(&config)?;
        let total = total_share(&config.proportions)?;
        Ok(Self::build(&config, |_, _, random| {
            let share = f64::from(random.uniform01()) * total;
            let difficulty = (level as f64 + f64::from(random.uniform01())) / LEVELS as f64;
            (kind.unwrap_or_else(|| family_at(&config.proportions, share)), difficulty)
        }))
    }

    /// Level ground with the spawn points of the default grid.
    pub fn flat() -> Self {
        let GridConfig { levels, columns, .. } = GridConfig::default();
        let tile = |index| Tile {
            kind: SubTerrain::Flat,
            difficulty: 0.0,
            spawn_w: spawn_point(levels, columns, index / columns, index % columns, 0.0),
        };
        let tiles = (0..levels * columns).map(tile).collect();
        Self { field: Arc::new(HeightField::flat(0.0)), levels, columns, tiles }
    }

    /// Rows of tiles along x.
    pub fn levels(&self) -> usize {
        self.levels
    }

    /// Columns of tiles along y.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Where robots start on a tile: its center, on the highest ground within 1 m of it; world frame \[m\].
    ///
    /// # Panics
    /// If there is no such tile.
    pub fn spawn(&self, level: usize, column: usize) -> [f32; 3] {
        self.tile(level, column).spawn_w
    }

    /// The family of a tile; in a training ground the same for a whole column.
    ///
    /// # Panics
    /// If there is no such tile.
    pub fn kind(&self, level: usize, column: usize) -> SubTerrain {
        self.tile(level, column).kind
    }

    /// The family of the tile under a point of the world, x and y \[m\]; level ground beyond all tiles.
    pub fn kind_at(&self, point: [f32; 2]) -> SubTerrain {
        let index = |coordinate: f32, count: usize| {
            let tile = (f64::from(coordinate) / TILE_SIZE_M + 0.5 * count as f64).floor();
            (0.0..count as f64).contains(&tile).then_some(tile as usize)
        };
        match (index(point[0], self.levels), index(point[1], self.columns)) {
            (Some(level), Some(column)) => self.kind(level, column),
            _ => SubTerrain::Flat,
        }
    }

    /// The difficulty with which a tile was shaped, 0 to 1.
    ///
    /// # Panics
    /// If there is no such tile.
    pub fn difficulty(&self, level: usize, column: usize) -> f64 {
        self.tile(level, column).difficulty
    }

    /// The column an environment walks on for good: environments are dealt out in equal, consecutive groups.
    pub fn column_of_env(&self, env: usize, num_envs: usize) -> usize {
        (env * self.columns / num_envs.max(1)).min(self.columns - 1)
    }

    fn tile(&self, level: usize, column: usize) -> &Tile {
        assert!(
            level < self.levels && column < self.columns,
            "no tile ({level}, {column}) in {} levels of {} columns",
            self.levels,
            self.columns
        );
        &self.tiles[level * self.columns + column]
    }

    /// Shapes every tile with the family and difficulty that `plan(level, column, random)` gives.
    fn build(config: &GridConfig, plan: impl Fn(usize, usize, &mut Philox) -> (SubTerrain, f64)) -> Self {
        let (levels, columns) = (config.levels, config.columns);
        let border = border_cells(config);
        let mut field = level_field(cells_along(config));
        let mut cells = TileCells::flat();
        let mut tiles = Vec::with_capacity(levels * columns);
        for level in 0..levels {
            for column in 0..columns {
                let mut random = Philox::new(config.seed, column, level as u32, 0, Purpose::Terrain);
                let (kind, difficulty) = plan(level, column, &mut random);
                kind.generate(difficulty, &mut random, &mut cells);
                let corner = [border + level * TILE_CELLS, border + column * TILE_CELLS];
                place(&cells, corner, &mut field);
                let spawn_w = spawn_point(levels, columns, level, column, cells.start_height());
                tiles.push(Tile { kind, difficulty, spawn_w });
            }
        }
        Self { field: Arc::new(field), levels, columns, tiles }
    }
}

/// Width of the border, in cells.
fn border_cells(config: &GridConfig) -> usize {
    (config.border_m / CELL_SIZE_M).round() as usize
}

/// Cells along x and y, with the border.
fn cells_along(config: &GridConfig) -> [usize; 2] {
    [config.levels, config.columns].map(|tiles| tiles * TILE_CELLS + 2 * border_cells(config))
}

/// Level ground of so many cells along x and y, centered on the world's origin.
fn level_field([along_x, along_y]: [usize; 2]) -> HeightField {
    let start = |cells: usize| (-0.5 * CELL_SIZE_M * cells as f64) as f32;
    HeightField {
        cell_size: CELL_SIZE_M as f32,
        origin: [start(along_x), start(along_y)],
        columns: along_x,
        rows: along_y,
        cells: vec![[0.0; 4]; along_x * along_y],
    }
}

/// Copies a tile to the cells of the field from (column, row) = `corner` on.
fn place(tile: &TileCells, corner: [usize; 2], field: &mut HeightField) {
    for row in 0..TILE_CELLS {
        let start = (corner[1] + row) * field.columns + corner[0];
        field.cells[start..start + TILE_CELLS].copy_from_slice(tile.row(row));
    }
}

/// Center of a tile at the height `z`, world frame \[m\].
fn spawn_point(levels: usize, columns: usize, level: usize, column: usize, z: f32) -> [f32; 3] {
    let center =
        |index: usize, count: usize| ((index as f64 + 0.5 - 0.5 * count as f64) * TILE_SIZE_M) as f32;
    [center(level, levels), center(column, columns), z]
}

fn check_size(name: &'static str, value: f64, low: f64, high: f64) -> Result<(), TerrainError> {
    if (low..=high).contains(&value) { Ok(()) } else { Err(TerrainError::Size { name, value, low, high }) }
}

fn check_cells(config: &GridConfig) -> Result<(), TerrainError> {
    let [along_x, along_y] = cells_along(config).map(|count| count + 2);
    let cells = along_x * along_y;
    if cells <= MAX_CELLS { Ok(()) } else { Err(TerrainError::Cells { cells }) }
}

/// Sum of the shares.
fn total_share(proportions: &[(SubTerrain, f64)]) -> Result<f64, TerrainError> {
    for &(kind, share) in proportions {
        if !(share.is_finite() && share >= 0.0) {
            return Err(TerrainError::Share { kind, share });
        }
    }
    let total = proportions.iter().map(|(_, share)| share).sum();
    if total > 0.0 { Ok(total) } else { Err(TerrainError::NoShare) }
}

/// The family in whose part of the cumulated shares `share` lies.
fn family_at(proportions: &[(SubTerrain, f64)], share: f64) -> SubTerrain {
    let mut sum = 0.0;
    let found = proportions.iter().find(|(_, own)| {
        sum += own;
        share < sum
    });
    found.map_or(SubTerrain::Flat, |(kind, _)| *kind)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cell_has_an_exact_index() {
        let layout = |border_m| GridConfig { levels: 51, columns: 51, border_m, ..GridConfig::default() };
        assert_eq!(check_cells(&layout(0.6)), Ok(()));
        assert_eq!(check_cells(&layout(0.7)), Err(TerrainError::Cells { cells: 1 << 24 }));
    }
}
