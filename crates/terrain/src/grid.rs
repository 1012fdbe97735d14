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

/// Most tiles along an axis: 100 × 100 are 1 GB of cells.
const MAX_TILES: usize = 100;
/// Widest border \[m\].
const MAX_BORDER_M: f64 = 100.0;

/// Layout of the training ground; the default is Isaac Lab's `ROUGH_TERRAINS_CFG`.
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
    /// A size or share outside its bounds.
    pub fn new(config: &GridConfig) -> Result<Self, TerrainError> {
        check_size("levels", config.levels as f64, 1.0, MAX_TILES as f64)?;
        check_size("columns", config.columns as f64, 1.0, MAX_TILES as f64)?;
        check_size("border_m", config.border_m, 0.0, MAX_BORDER_M)?;
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
    /// `level` above 9, or `size` not within 1 to 100.
    pub fn uniform(
        kind: Option<SubTerrain>,
        level: usize,
        seed: u64,
        size: usize,
    ) -> Result<Self, TerrainError> {
        check_size("level", level as f64, 0.0, (LEVELS - 1) as f64)?;
        check_size("size", size as f64, 1.0, MAX_TILES as f64)?;
        let config = GridConfig { levels: size, columns: size, seed, ..GridConfig::default() };
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
        let border = (config.border_m / CELL_SIZE_M).round() as usize;
        let mut field = level_field(levels, columns, border);
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

/// Level ground under `levels` × `columns` tiles and a border of `border` cells, centered on the world's origin.
fn level_field(levels: usize, columns: usize, border: usize) -> HeightField {
    let along_x = levels * TILE_CELLS + 2 * border;
    let along_y = columns * TILE_CELLS + 2 * border;
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

    fn small(seed: u64) -> TerrainGrid {
        TerrainGrid::new(&GridConfig { levels: 3, columns: 10, border_m: 2.0, seed, ..GridConfig::default() })
            .expect("a valid layout")
    }

    #[test]
    fn the_default_grid_is_the_reference_layout() {
        let grid = TerrainGrid::new(&GridConfig::default()).expect("a valid layout");
        assert_eq!((grid.field.columns, grid.field.rows), (1200, 2000));
        assert_eq!(grid.field.origin, [-60.0, -100.0]);
        assert_eq!(grid.spawn(0, 0)[..2], [-36.0, -76.0]);
        assert_eq!(grid.spawn(9, 19)[..2], [36.0, 76.0]);
        for (column, kind) in [
            (0, SubTerrain::StairsUp),
            (3, SubTerrain::StairsUp),
            (4, SubTerrain::StairsDown),
            (8, SubTerrain::Boxes),
            (15, SubTerrain::RandomRough),
            (16, SubTerrain::SlopeUp),
            (17, SubTerrain::SlopeUp),
            (18, SubTerrain::SlopeDown),
            (19, SubTerrain::SlopeDown),
        ] {
            assert!((0..10).all(|level| grid.kind(level, column) == kind), "column {column}");
        }
        for level in 0..10 {
            for column in 0..20 {
                let tenth = grid.difficulty(level, column) * 10.0 - level as f64;
                assert!((0.0..1.0).contains(&tenth));
            }
        }
    }

    #[test]
    fn robots_start_on_the_ground_below_their_spawn_point_or_above_it() {
        let grid = small(1);
        for level in 0..grid.levels() {
            for column in 0..grid.columns() {
                let [x, y, z] = grid.spawn(level, column);
                let ground = grid.field.height(x, y);
                let rough = if grid.kind(level, column) == SubTerrain::RandomRough { 0.08 } else { 0.0 };
                assert!((-1e-6..=rough + 1e-6).contains(&(z - ground)));
            }
        }
    }

    #[test]
    fn risers_stand_on_the_grid_in_the_world_frame() {
        let grid = small(2);
        let [x, y, plateau] = grid.spawn(2, 0);
        assert_eq!(grid.kind(2, 0), SubTerrain::StairsUp);
        let step = plateau / 7.0;
        for (riser, distance) in [1.2, 1.5, 1.8, 2.1, 2.4, 2.7, 3.0].into_iter().enumerate() {
            let above = grid.field.height(x - distance + 1e-3, y);
            let below = grid.field.height(x - distance - 1e-3, y);
            assert!((above - below - step).abs() < 1e-5, "riser {riser}");
        }
    }

    #[test]
    fn tiles_meet_each_other_and_the_border_at_height_0() {
        let field = small(3).field;
        for row in 0..field.rows {
            for column in 0..field.columns {
                // The border is 20 cells wide.
                let on_edge =
                    |index: usize| [0, TILE_CELLS - 1].contains(&((index + TILE_CELLS - 20) % TILE_CELLS));
                if on_edge(column) || on_edge(row) {
                    assert_eq!(field.cell(column as i64, row as i64), [0.0; 4]);
                }
            }
        }
    }

    #[test]
    fn the_same_seed_gives_the_same_ground_and_another_seed_another() {
        assert_eq!(small(4), small(4));
        assert_ne!(small(4).field, small(5).field);
        assert_ne!(small(4).difficulty(0, 0), small(4).difficulty(0, 1));
    }

    #[test]
    fn a_tile_does_not_depend_on_the_rest_of_the_grid() {
        let (few, many) =
            (small(6), TerrainGrid::new(&GridConfig { seed: 6, columns: 10, ..GridConfig::default() }));
        let many = many.expect("a valid layout");
        let sample = |grid: &TerrainGrid| {
            let [x, y, _] = grid.spawn(1, 6);
            grid.field.height(x + 1.03, y - 0.57)
        };
        assert_eq!(few.kind(1, 6), SubTerrain::RandomRough);
        // The tiles lie elsewhere in the world, where positions round differently.
        assert!((sample(&few) - sample(&many)).abs() < 2e-5);
        assert_ne!(sample(&few), sample(&small(7)));
    }

    #[test]
    fn environments_are_dealt_out_evenly() {
        let grid = small(0);
        assert!((0..20).all(|env| grid.column_of_env(env, 20) == env / 2));
        assert_eq!(grid.column_of_env(6, 7), 8);
        assert_eq!(grid.column_of_env(0, 0), 0);
        let mut counts = [0; 10];
        (0..4096).for_each(|env| counts[grid.column_of_env(env, 4096)] += 1);
        assert!(counts.iter().all(|n| (409..=410).contains(n)));
    }

    #[test]
    fn uniform_ground_has_one_level() {
        for kind in SubTerrain::ALL.map(Some) {
            let grid = TerrainGrid::uniform(kind, 5, 0, 2).expect("a valid layout");
            for (level, column) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                assert_eq!(Some(grid.kind(level, column)), kind);
                assert!((0.5..0.6).contains(&grid.difficulty(level, column)));
            }
        }
        let mix = TerrainGrid::uniform(None, 0, 0, 10).expect("a valid layout");
        let count = |kind| (0..100).filter(|i| mix.kind(i / 10, i % 10) == kind).count();
        // Three standard deviations about the shares of 0.2 and 0.1.
        assert!((8..=32).contains(&count(SubTerrain::Boxes)));
        assert!((1..=19).contains(&count(SubTerrain::SlopeDown)));
        assert_eq!(count(SubTerrain::Flat), 0);
    }

    #[test]
    fn flat_ground_has_spread_spawn_points() {
        let grid = TerrainGrid::flat();
        assert_eq!(grid.spawn(0, 0), [-36.0, -76.0, 0.0]);
        assert_eq!((grid.levels(), grid.columns()), (10, 20));
        assert_eq!(grid.field.height(12.3, -45.6), 0.0);
    }

    #[test]
    fn impossible_layouts_are_refused_by_name() {
        let refuse = |config: GridConfig| TerrainGrid::new(&config).expect_err("impossible").to_string();
        let default = GridConfig::default;
        assert_eq!(refuse(GridConfig { levels: 0, ..default() }), "terrain levels is 0; allowed: 1 to 100");
        assert_eq!(
            refuse(GridConfig { columns: 101, ..default() }),
            "terrain columns is 101; allowed: 1 to 100"
        );
        assert!(refuse(GridConfig { border_m: f64::NAN, ..default() }).contains("border_m is NaN"));
        let share = |value| vec![(SubTerrain::Boxes, value)];
        assert!(refuse(GridConfig { proportions: share(-0.1), ..default() }).contains("Boxes is -0.1"));
        assert!(refuse(GridConfig { proportions: share(0.0), ..default() }).contains("sum to 0"));
        assert!(refuse(GridConfig { proportions: vec![], ..default() }).contains("sum to 0"));
        assert!(TerrainGrid::uniform(None, 10, 0, 2).is_err());
        assert!(TerrainGrid::uniform(None, 0, 0, 0).is_err());
    }
}
