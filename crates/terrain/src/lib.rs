//! Height fields, sub-terrains, the level × type grid and surface queries.
//!
//! [`TerrainGrid`] lays out the ground once, from a seed; after that physics and sensors only read its
//! [`HeightField`].

pub mod curriculum;
pub mod grid;
pub mod height_field;
pub mod scan;
pub mod sub_terrain;
pub mod tile;
pub mod triangles;

pub use curriculum::next_level;
pub use grid::{GridConfig, LEVELS, TerrainError, TerrainGrid};
pub use height_field::{Cell, HeightField};
pub use scan::{SCAN_COLUMNS, SCAN_POINTS, SCAN_ROWS};
pub use sub_terrain::SubTerrain;
pub use tile::{CELL_SIZE_M, TILE_CELLS, TILE_SIZE_M, TileCells};
