//! A ball across the borders and diagonals of cells that lie in one plane: no cell may be felt.

mod ball;

use ball::{Roller, cells};
use physics::Config;
use spatial::Vec3;
use terrain::HeightField;

const RADIUS: f64 = 0.03;
/// Time of a run \[s\], during which the ball stays on the field.
const TIME: f64 = 0.7;

/// The plane z = `slope` · (x, y), in cells of `size` \[m\].
fn plane(size: f32, slope: [f32; 2]) -> HeightField {
    let height = move |column: usize, row: usize| size * (slope[0] * column as f32 + slope[1] * row as f32);
    cells(size, |c, r| [height(c, r), height(c + 1, r), height(c, r + 1), height(c + 1, r + 1)])
}

fn normal(slope: [f32; 2]) -> Vec3<f64> {
    let [x, y] = slope.map(f64::from);
    Vec3::splat([-x, -y, 1.0]).scale(1.0 / (x * x + y * y + 1.0).sqrt())
}

/// A ball that touches the plane above (`x`, `y`) and moves along it.
fn on_plane(size: f32, slope: [f32; 2], [x, y]: [f64; 2], velocity: [f64; 2]) -> Roller {
    let [along_x, along_y] = slope.map(f64::from);
    let touching = Vec3::splat([x, y, x * along_x + y * along_y]);
    let center = normal(slope).scale_add(RADIUS, touching);
    let [v_x, v_y] = velocity;
    Roller::new(RADIUS, plane(size, slope), Config::default(), center.to_array()).moving([
        v_x,
        v_y,
        v_x * along_x + v_y * along_y,
    ])
}

/// Largest difference between the velocity and one that grows by `acceleration`, and of the height above the plane
/// from the radius, over a run.
fn deviation(ball: &mut Roller, slope: [f32; 2], acceleration: Vec3<f64>) -> [f64; 2] {
    let dt = ball.engine.config().time_step;
    let start = ball.velocity();
    let mut largest = [0.0_f64; 2];
    for count in 1..=(TIME / dt) as usize {
        ball.step();
        let expected = acceleration.scale_add(dt * count as f64, start);
        let height = ball.position().dot(normal(slope)) - RADIUS;
        largest = [largest[0].max((ball.velocity() - expected).norm()), largest[1].max(height.abs())];
    }
    let [x, y, _] = ball.position().to_array();
    let width = 32.0 * f64::from(ball.engine.terrain().cell_size);
    assert!((0.0..width).contains(&x) && (0.0..width).contains(&y), "left the field");
    largest
}

/// Gravity's part along the plane \[m/s²\].
fn downhill(slope: [f32; 2]) -> Vec3<f64> {
    let gravity = Vec3::splat([0.0, 0.0, -9.81]);
    let n = normal(slope);
    n.scale_add(-n.dot(gravity), gravity)
}

/// Cells of 1/8 m and these slopes are exact in binary: what is felt then is the solver's.
const EXACT: [[f32; 2]; 4] = [[0.0, 0.0], [0.25, 0.0], [0.0, -0.25], [0.25, 0.125]];
/// Ways to go from the middle of the field: across borders along x, along y, and across corners along the diagonals.
const WAYS: [[f64; 2]; 6] = [[1.3, 0.0], [0.0, -1.3], [1.0, 1.0], [1.0, -1.0], [0.9, 0.4], [-0.3, 0.0]];

#[test]
fn sliding_across_cells_of_one_plane_is_sliding_on_a_plane() {
    for slope in EXACT {
        for way in WAYS {
            let mut ball = on_plane(0.125, slope, [2.01, 2.05], way);
            let [velocity, height] = deviation(&mut ball, slope, downhill(slope));
            assert!(velocity < 1e-12, "{slope:?} {way:?}: velocity off by {velocity:e} m/s");
            assert!(height < 1e-12, "{slope:?} {way:?}: height off by {height:e} m");
        }
    }
}

#[test]
fn rolling_across_cells_of_one_plane_is_rolling_on_a_plane() {
    for slope in EXACT {
        for way in WAYS {
            let mut ball = on_plane(0.125, slope, [2.01, 2.05], way).with_friction(0.8);
            // Without slip: ω = n × v / r.
            let spin = normal(slope).cross(ball.velocity()).scale(1.0 / RADIUS);
            ball.block.state.base_angular_velocity = spin;
            // A solid ball rolls down with 5/7 of what it slides with.
            let [velocity, height] = deviation(&mut ball, slope, downhill(slope).scale(5.0 / 7.0));
            assert!(velocity < 1e-9, "{slope:?} {way:?}: velocity off by {velocity:e} m/s");
            assert!(height < 1e-9, "{slope:?} {way:?}: height off by {height:e} m");
        }
    }
}

#[test]
fn heights_rounded_to_single_precision_are_felt_as_little_as_they_are_wrong() {
    // Corners of the usual 0.1 m cells are off by up to 1e-8 m, slopes by 1e-7.
    for way in WAYS {
        let slope = [0.25, 0.1];
        let mut ball = on_plane(0.1, slope, [1.61, 1.65], way.map(|v| 0.6 * v));
        let [velocity, height] = deviation(&mut ball, slope, downhill(slope));
        assert!(velocity < 1e-5, "{way:?}: velocity off by {velocity:e} m/s");
        assert!(height < 1e-6, "{way:?}: height off by {height:e} m");
    }
}
