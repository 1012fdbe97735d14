//! The whole ground: layout, borders, determinism, refusals.

use terrain::{GridConfig, SubTerrain, TILE_CELLS, TerrainGrid};

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
fn every_point_lies_on_a_tile_or_on_level_ground() {
    let grid = TerrainGrid::new(&GridConfig::default()).expect("a valid layout");
    for (level, column) in [(0, 0), (9, 19), (4, 8)] {
        let [x, y, _] = grid.spawn(level, column);
        for corner in [[x - 3.9, y - 3.9], [x, y], [x + 3.9, y + 3.9]] {
            assert_eq!(grid.kind_at(corner), grid.kind(level, column));
        }
    }
    for beyond in [[-40.1, 0.0], [40.1, 0.0], [0.0, -80.1], [0.0, 1e9]] {
        assert_eq!(grid.kind_at(beyond), SubTerrain::Flat);
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
    assert_eq!(refuse(GridConfig { columns: 101, ..default() }), "terrain columns is 101; allowed: 1 to 100");
    assert!(refuse(GridConfig { border_m: f64::NAN, ..default() }).contains("border_m is NaN"));
    let large = refuse(GridConfig { levels: 47, columns: 47, ..default() });
    assert!(large.contains("17322244 cells") && large.contains("up to 16777215"), "{large}");
    assert_eq!(TerrainGrid::uniform(None, 0, 0, 47).expect_err("impossible").to_string(), large);
    let share = |value| vec![(SubTerrain::Boxes, value)];
    assert!(refuse(GridConfig { proportions: share(-0.1), ..default() }).contains("Boxes is -0.1"));
    assert!(refuse(GridConfig { proportions: share(0.0), ..default() }).contains("sum to 0"));
    assert!(refuse(GridConfig { proportions: vec![], ..default() }).contains("sum to 0"));
    assert!(TerrainGrid::uniform(None, 10, 0, 2).is_err());
    assert!(TerrainGrid::uniform(None, 0, 0, 0).is_err());
}
