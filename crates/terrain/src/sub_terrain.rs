//! The families of ground, one tile at a time.
//!
//! Sizes are those of Isaac Lab's rough terrain (`terrains/config/rough.py`, shapes in `trimesh/mesh_terrains.py` and
//! `height_field/hf_terrains.py`), with two deviations: boxes are 0.5 m wide instead of 0.45 m, so that their faces
//! lie on the 0.1 m grid, and heights are not rounded to 5 mm. Every tile is level at height 0 along its edges, so
//! that tiles can be laid side by side in any order and walked from one to the next.

use spatial::Philox;

use crate::tile::{CELL_SIZE_M, TILE_CELLS, TileCells, edge_distance};

/// A family of ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SubTerrain {
    /// Pyramid of stairs up to a plateau in the center; robots start above and first walk down.
    StairsUp,
    /// Inverted pyramid: stairs down to the bottom of a pit, where robots start.
    StairsDown,
    /// Square blocks of random height around a raised platform.
    Boxes,
    /// Random heights at all vertices of the grid, as rough at any difficulty.
    RandomRough,
    /// Slopes up to a plateau.
    SlopeUp,
    /// Slopes down to the bottom of a basin.
    SlopeDown,
    /// Level ground.
    Flat,
}

/// Level border around stairs, in cells (1 m).
const STAIRS_BORDER: usize = 10;
/// Depth of a tread, in cells (0.3 m).
const TREAD: usize = 3;
/// Treads between border and plateau: ⌊(8 − 2 · 1 − 3) m / (2 · 0.3 m)⌋ + 1. The plateau is the next step, 7 risers
/// above the border; 2.4 m are left to it of the nominal 3 m.
const TREADS: usize = 6;
/// Level border around boxes, in cells (0.5 m): what is left beside 14 × 14 boxes.
const BOXES_BORDER: usize = 5;
/// Edge of a box, in cells (0.5 m).
const BOX: usize = 5;
/// Boxes along the edge of a tile.
const BOXES: usize = (TILE_CELLS - 2 * BOXES_BORDER) / BOX;
/// Half the edge of the platform of boxes and slopes, in cells (1 m).
const HALF_PLATFORM: usize = 10;
/// Vertices at height 0 along the edges of rough ground and slopes.
const SURFACE_BORDER: usize = 3;

impl SubTerrain {
    /// Every family.
    pub const ALL: [Self; 7] = [
        Self::StairsUp,
        Self::StairsDown,
        Self::Boxes,
        Self::RandomRough,
        Self::SlopeUp,
        Self::SlopeDown,
        Self::Flat,
    ];

    /// Its name in tables and `results.json`.
    pub fn name(self) -> &'static str {
        match self {
            Self::StairsUp => "stairs up",
            Self::StairsDown => "stairs down",
            Self::Boxes => "boxes",
            Self::RandomRough => "random rough",
            Self::SlopeUp => "slope up",
            Self::SlopeDown => "slope down",
            Self::Flat => "level ground",
        }
    }

    /// Shapes `tile` at `difficulty`, 0 (easiest) to 1; all of the tile is overwritten.
    pub fn generate(self, difficulty: f64, random: &mut Philox, tile: &mut TileCells) {
        let step_height = (0.05 + 0.18 * difficulty) as f32;
        let box_height = (0.05 + 0.15 * difficulty) as f32;
        let slope = (0.4 * difficulty) as f32;
        match self {
            Self::StairsUp => stairs(step_height, tile),
            Self::StairsDown => stairs(-step_height, tile),
            Self::Boxes => boxes(box_height, random, tile),
            Self::RandomRough => random_rough(random, tile),
            Self::SlopeUp => pyramid_slope(slope, tile),
            Self::SlopeDown => pyramid_slope(-slope, tile),
            Self::Flat => tile.set_cells(|_, _| 0.0),
        }
    }
}

/// Square rings of treads, each a step of `step_height` \[m\] above the one outside it (below, if negative).
fn stairs(step_height: f32, tile: &mut TileCells) {
    tile.set_cells(|column, row| {
        let inward = edge_distance(column, row, TILE_CELLS - 1);
        let steps = if inward < STAIRS_BORDER { 0 } else { (inward - STAIRS_BORDER) / TREAD + 1 };
        steps.min(TREADS + 1) as f32 * step_height
    });
}

/// Boxes of height uniform in ±`height` \[m\] and a platform at +`height`.
fn boxes(height: f32, random: &mut Philox, tile: &mut TileCells) {
    let tops: [[f32; BOXES]; BOXES] =
        std::array::from_fn(|_| std::array::from_fn(|_| random.uniform(-height, height)));
    tile.set_cells(|column, row| {
        let inward = edge_distance(column, row, TILE_CELLS - 1);
        if inward < BOXES_BORDER {
            0.0
        } else if inward >= TILE_CELLS / 2 - HALF_PLATFORM {
            height
        } else {
            tops[(row - BOXES_BORDER) / BOX][(column - BOXES_BORDER) / BOX]
        }
    });
}

/// Heights 0.02, 0.04, … 0.10 m, drawn for each vertex.
fn random_rough(random: &mut Philox, tile: &mut TileCells) {
    tile.set_vertices(|column, row| {
        let height = 0.02 * (1 + random.below(5)) as f32;
        if edge_distance(column, row, TILE_CELLS) < SURFACE_BORDER { 0.0 } else { height }
    });
}

/// The surface `slope` · r · u · w, cut off level at the corners of the platform, where u and w run from 0 at the
/// tile's border to 1 at its center, a distance r away. On the center lines its gradient is `slope`.
fn pyramid_slope(slope: f32, tile: &mut TileCells) {
    const RUN: usize = TILE_CELLS / 2 - SURFACE_BORDER;
    let toward_center = |index: usize| {
        let inward = index.min(TILE_CELLS - index);
        inward.saturating_sub(SURFACE_BORDER) as f32 / RUN as f32
    };
    let at_platform = toward_center(TILE_CELLS / 2 - HALF_PLATFORM);
    let full_height = slope * CELL_SIZE_M as f32 * RUN as f32;
    tile.set_vertices(|column, row| {
        let share = toward_center(column) * toward_center(row);
        full_height * share.min(at_platform * at_platform)
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use spatial::Purpose;

    fn tile(kind: SubTerrain, difficulty: f64) -> TileCells {
        let mut tile = TileCells::flat();
        // Whatever was there before must not show.
        tile.set_cells(|_, _| 9.0);
        kind.generate(difficulty, &mut Philox::new(3, 1, 2, 0, Purpose::Terrain), &mut tile);
        tile
    }

    /// Level heights of the cells along the center line in x, from the edge to the center.
    fn profile(tile: &TileCells) -> Vec<f32> {
        tile.row(TILE_CELLS / 2)[..TILE_CELLS / 2]
            .iter()
            .map(|cell| {
                assert!(cell.iter().all(|h| *h == cell[0]), "the cell is not level: {cell:?}");
                cell[0]
            })
            .collect()
    }

    #[test]
    fn seven_vertical_risers_of_equal_height_lead_to_the_plateau() {
        for (kind, sign) in [(SubTerrain::StairsUp, 1.0), (SubTerrain::StairsDown, -1.0)] {
            for (difficulty, step) in [(0.0, 0.05), (0.5, 0.14), (1.0, 0.23)] {
                let tile = tile(kind, difficulty);
                let profile = profile(&tile);
                let risers: Vec<usize> =
                    (1..profile.len()).filter(|&i| profile[i] != profile[i - 1]).collect();
                assert_eq!(risers, [10, 13, 16, 19, 22, 25, 28]);
                for &i in &risers {
                    assert!((profile[i] - profile[i - 1] - sign * step).abs() < 1e-6);
                }
                assert!((tile.start_height() - 7.0 * sign * step).abs() < 1e-5);
            }
        }
    }

    #[test]
    fn stairs_are_the_same_seen_from_all_four_sides() {
        let tile = tile(SubTerrain::StairsUp, 0.7);
        for row in 0..TILE_CELLS {
            for column in 0..TILE_CELLS {
                let cell = tile.row(row)[column];
                assert_eq!(cell, tile.row(column)[row]);
                assert_eq!(cell, tile.row(TILE_CELLS - 1 - row)[column]);
            }
        }
    }

    #[test]
    fn boxes_are_level_half_meter_squares_within_their_bounds() {
        for (difficulty, height) in [(0.0_f64, 0.05_f32), (1.0, 0.2)] {
            let tile = tile(SubTerrain::Boxes, difficulty);
            let mut highest = 0.0_f32;
            for row in BOXES_BORDER..TILE_CELLS - BOXES_BORDER {
                for column in BOXES_BORDER..TILE_CELLS - BOXES_BORDER {
                    let [a, b, c, d] = tile.row(row)[column];
                    assert!(a == b && b == c && c == d && a.abs() <= height);
                    assert_eq!(a, tile.row(row / BOX * BOX)[column / BOX * BOX][0]);
                    highest = highest.max(a);
                }
            }
            assert_eq!(tile.start_height(), height);
            assert_eq!(highest, height);
            // The platform is 2 m wide, and what is beside it was drawn.
            assert!(tile.row(30)[30..50].iter().all(|cell| *cell == [height; 4]));
            assert!(tile.row(40)[29][0] < height && tile.row(40)[50][0] < height);
        }
    }

    #[test]
    fn random_heights_are_five_levels_on_a_continuous_surface() {
        let tile = tile(SubTerrain::RandomRough, 0.3);
        let mut counts = [0; 6];
        for row in 3..TILE_CELLS - 3 {
            for column in 3..TILE_CELLS - 3 {
                let [h00, h10, h01, _] = tile.row(row)[column];
                assert_eq!(h10, tile.row(row)[column + 1][0]);
                assert_eq!(h01, tile.row(row + 1)[column][0]);
                counts[(h00 / 0.02).round() as usize] += 1;
                assert!(((h00 / 0.02).round() * 0.02 - h00).abs() < 1e-6);
            }
        }
        assert_eq!(counts[0], 0);
        let expected = 74.0 * 74.0 / 5.0;
        // Four standard deviations of a binomial count.
        assert!(counts[1..].iter().all(|&n| (f64::from(n) - expected).abs() < 4.0 * (0.8 * expected).sqrt()));
    }

    #[test]
    fn roughness_ignores_the_difficulty() {
        assert_eq!(tile(SubTerrain::RandomRough, 0.0), tile(SubTerrain::RandomRough, 1.0));
    }

    #[test]
    fn slopes_rise_with_their_gradient_to_a_level_platform() {
        for (kind, slope) in [(SubTerrain::SlopeUp, 0.4), (SubTerrain::SlopeDown, -0.4)] {
            for difficulty in [0.25, 1.0] {
                let tile = tile(kind, difficulty);
                let gradient = slope * difficulty as f32;
                for column in SURFACE_BORDER..SURFACE_BORDER + 19 {
                    let [h00, h10, ..] = tile.row(TILE_CELLS / 2)[column];
                    assert!(((h10 - h00) / 0.1 - gradient).abs() < 1e-5);
                }
                let plateau = gradient * 3.7 * (27.0_f32 / 37.0).powi(2);
                for row in 30..50 {
                    assert!(tile.row(row)[30..50].iter().flatten().all(|h| (h - plateau).abs() < 1e-5));
                }
                assert!((tile.start_height() - plateau).abs() < 1e-5);
            }
        }
    }

    #[test]
    fn every_family_is_level_at_height_0_along_the_edges_of_its_tile() {
        for kind in SubTerrain::ALL {
            let tile = tile(kind, 1.0);
            for row in 0..TILE_CELLS {
                for column in 0..TILE_CELLS {
                    if edge_distance(column, row, TILE_CELLS - 1) < 2 {
                        assert_eq!(tile.row(row)[column], [0.0; 4], "{kind:?} at {column}, {row}");
                    }
                }
            }
        }
    }
}
