//! The ground of an evaluation, and where robots start on it.

use spatial::Philox;
use terrain::{SubTerrain, TerrainGrid};

/// Tiles around those on which robots start: they walk at most 20 m.
const BORDER_TILES: usize = 2;
/// Most tiles along each axis on which robots start.
const MAX_INNER_TILES: usize = 20;

/// A ground of one level, of one family or of all, with so many tiles to start on, rounded up to a square, up to 400.
///
/// # Errors
/// The level is out of range.
pub(crate) fn tiles(
    kind: Option<SubTerrain>,
    level: usize,
    seed: u64,
    starts: usize,
) -> Result<TerrainGrid, String> {
    let inner = (starts as f64).sqrt().ceil().clamp(1.0, MAX_INNER_TILES as f64) as usize;
    TerrainGrid::uniform(kind, level, seed, inner + 2 * BORDER_TILES).map_err(|error| error.to_string())
}

/// Where a robot starts: on any inner tile.
pub(crate) fn start(grid: &TerrainGrid, random: &mut Philox) -> [f32; 3] {
    let mut inner = |count: usize| BORDER_TILES + random.below((count - 2 * BORDER_TILES) as u32) as usize;
    grid.spawn(inner(grid.levels()), inner(grid.columns()))
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use spatial::Purpose;

    use super::*;

    #[test]
    fn episodes_start_on_as_many_tiles_as_there_are_to_tell_grounds_apart() {
        let starts = |episodes: usize| {
            let grid = tiles(Some(SubTerrain::Flat), 0, 1, episodes).unwrap();
            let start = |robot| start(&grid, &mut Philox::new(1, robot, 0, 0, Purpose::Reset));
            let starts: HashSet<[u32; 3]> = (0..1000).map(|robot| start(robot).map(f32::to_bits)).collect();
            (grid.levels(), starts.len())
        };
        assert_eq!(starts(1), (5, 1));
        assert_eq!(starts(40), (11, 49));
        let (size, tiles) = starts(1000);
        assert!(size == 24 && (350..=400).contains(&tiles), "{tiles} of 400 tiles");
    }
}
