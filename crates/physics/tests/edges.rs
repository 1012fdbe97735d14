//! A ball at steps and corners: it rests in inner edges, leaves outer ones as mechanics says, and passes no wall.

mod ball;

use ball::{Roller, cells};
use physics::Config;
use spatial::Vec3;
use terrain::HeightField;

const RADIUS: f64 = 0.03;
/// Where a ball touches a riser at 1 m from the left \[m\].
const AT_RISER: f64 = 1.0 - RADIUS;

/// Ground 0 for x < 1 m, a step of `height` \[m\] from there on.
fn step(height: f32) -> HeightField {
    cells(0.1, |column, _| [if column >= 10 { height } else { 0.0 }; 4])
}

/// Ground 0 where both x < 1 m and y < 1 m, 0.2 m elsewhere: two walls that meet.
fn corner() -> HeightField {
    cells(0.1, |column, row| [if column >= 10 || row >= 10 { 0.2 } else { 0.0 }; 4])
}

/// Ground 0.2 m where both x > 1 m and y > 1 m, 0 elsewhere: the corner of a box.
fn boxed() -> HeightField {
    cells(0.1, |column, row| [if column >= 10 && row >= 10 { 0.2 } else { 0.0 }; 4])
}

fn fine(time_step: f64) -> Config {
    Config { time_step, ..Config::default() }
}

/// Force of the ground \[N\].
fn force(ball: &Roller) -> Vec3<f64> {
    ball.block.output.contact_force[0]
}

#[test]
fn in_the_inner_edge_a_ball_rests_and_both_faces_carry_it() {
    for friction in [0.0, 0.8] {
        let config = Config { gravity: [3.0, 0.0, -9.81], ..Config::default() };
        let start = [AT_RISER, 0.55, RADIUS];
        let mut ball = Roller::new(RADIUS, step(0.2), config, start).with_friction(friction);
        (0..400).for_each(|_| ball.step());
        let moved = (ball.position() - Vec3::splat(start)).norm();
        assert!(moved < 1e-7, "µ {friction}: moved by {moved:e} m");
        let error = (force(&ball) - Vec3::splat([-3.0, 0.0, 9.81])).norm();
        assert!(error < 1e-6, "µ {friction}: carried with {:?}", force(&ball));
    }
}

#[test]
fn sliding_off_an_edge_is_free_flight() {
    // At 1 m/s gravity cannot keep the ball on the edge: g r < v². It is last carried 2.5 mm before the edge.
    let mut ball = Roller::new(RADIUS, step(0.2), Config::default(), [1.2025, 0.55, 0.2 + RADIUS])
        .moving([-1.0, 0.0, 0.0]);
    (0..41).for_each(|_| ball.step());
    assert!((force(&ball).z - 9.81).abs() < 1e-4 && (ball.position().x - 0.9975).abs() < 1e-9);
    let start = ball.position();
    for count in 1..=20 {
        ball.step();
        assert_eq!(force(&ball), Vec3::zero(), "{count} steps behind the edge");
    }
    // Semi-implicit Euler falls g t (t + dt) / 2.
    let expected = start - Vec3::splat([0.1, 0.0, 9.81 * 0.1 * 0.105 / 2.0]);
    assert!((ball.position() - expected).norm() < 1e-9, "{:?}, expected {expected:?}", ball.position());
}

#[test]
fn a_ball_tipping_over_an_edge_leaves_it_where_mechanics_says() {
    // Without friction the center circles the edge and leaves it where cos θ = 2/3 of where it began: there gravity's
    // part toward the edge is all the circle needs. Then v² = g r cos θ, and v cos θ stays.
    let (radius, height, begin): (f64, f64, f64) = (0.1, 0.35, 0.05);
    let ground = cells(1.0, |column, _| [if column >= 1 { height as f32 } else { 0.0 }; 4]);
    let start = [1.0 - radius * begin.sin(), 1.5, height + radius * begin.cos()];
    let mut ball = Roller::new(radius, ground, fine(1e-4), start);
    while ball.position().z > height {
        ball.step();
        let to_edge = ball.position() - Vec3::splat([1.0, 1.5, height]);
        assert!(to_edge.norm() > radius - 1e-5, "{:e} m inside the edge", radius - to_edge.norm());
    }
    let cosine = 2.0 / 3.0 * begin.cos();
    let expected = -(9.81 * radius * cosine).sqrt() * cosine;
    assert!((ball.velocity().x / expected - 1.0).abs() < 2e-3, "{} m/s, not {expected}", ball.velocity().x);
}

#[test]
fn a_riser_stops_a_ball_that_hits_it() {
    for speed in [0.5, 2.0, 4.0] {
        // Starts a millimeter apart, so that the hit falls on every part of a time step.
        for phase in 0..20 {
            let start = [0.9 - 1e-3 * f64::from(phase), 0.55, RADIUS];
            let mut ball = Roller::new(RADIUS, step(0.2), Config::default(), start).moving([speed, 0.0, 0.0]);
            for _ in 0..100 {
                ball.step();
                let [x, y, z] = ball.position().to_array();
                assert!(x < AT_RISER + 1e-7, "at {speed} m/s into the riser by {:e} m", x - AT_RISER);
                assert!((z - RADIUS).abs() < 1e-9 && y == 0.55, "climbed to {z} at {speed} m/s");
            }
            assert!((ball.position().x - AT_RISER).abs() < 1e-6);
            assert!(ball.velocity().norm() < 1e-6, "bounced with {:?}", ball.velocity());
        }
    }
}

#[test]
fn a_ball_wider_than_half_a_cell_overlaps_a_riser_before_it_sees_it() {
    // A wall is seen within half a cell of the center, 50 mm. What a step enters by, the next finds.
    let (radius, unseen) = (0.06, 0.01);
    for speed in [0.2, 1.0, 2.0] {
        let travel = speed * Config::default().time_step;
        for phase in 0..20 {
            let start = [0.9 - 1e-3 * f64::from(phase), 0.55, radius];
            let mut ball = Roller::new(radius, step(0.2), Config::default(), start).moving([speed, 0.0, 0.0]);
            let mut deepest = f64::MIN;
            for _ in 0..200 {
                ball.step();
                deepest = deepest.max(ball.position().x + radius - 1.0);
                assert!((ball.position().z - radius).abs() < 1e-9, "climbed to {}", ball.position().z);
                assert!(ball.velocity().x > -1.0 - 1e-9, "pushed out with {:?}", ball.velocity());
            }
            let allowed = unseen - 1e-7..unseen + travel + 1e-7;
            assert!(allowed.contains(&deepest), "{speed} m/s: {deepest} m deep");
            let left = ball.position().x + radius - 1.0;
            assert!(left < 1e-6, "{left} m deep after a second");
        }
    }
}

#[test]
fn a_low_step_is_stepped_over_by_who_is_fast_enough() {
    // The edge takes the velocity toward it; what is left, v (1 − h/r), points up by as much, so v (1 − h/r)² forward.
    let (height, speed) = (0.005, 1.0);
    let over = |speed: f64| {
        let mut ball =
            Roller::new(RADIUS, step(height), fine(1e-4), [0.95, 0.55, RADIUS]).moving([speed, 0.0, 0.0]);
        (0..2500).for_each(|_| ball.step());
        ball
    };
    let ball = over(speed);
    let kept = 1.0 - f64::from(height) / RADIUS;
    let expected = speed * kept * kept;
    assert!(ball.position().x > 1.1 && ball.position().z > f64::from(height) + RADIUS - 1e-6);
    assert!((ball.velocity().x / expected - 1.0).abs() < 0.01, "{} m/s, not {expected}", ball.velocity().x);
    // To get up takes v² (1 − h/r)² > 2 g h: more than 0.38 m/s.
    assert!(over(0.36).position().x < 1.0 && over(0.40).position().x > 1.0);
}

#[test]
fn where_two_walls_meet_a_ball_rests_on_all_three_faces() {
    let config = Config { gravity: [3.0, 2.0, -9.81], ..Config::default() };
    let start = [AT_RISER, AT_RISER, RADIUS];
    let mut ball = Roller::new(RADIUS, corner(), config, start);
    (0..400).for_each(|_| ball.step());
    let moved = (ball.position() - Vec3::splat(start)).norm();
    assert!(moved < 1e-7, "moved by {moved:e} m");
    let error = (force(&ball) - Vec3::splat([-3.0, -2.0, 9.81])).norm();
    assert!(error < 1e-6, "carried with {:?}", force(&ball));
}

#[test]
fn no_ball_passes_where_two_walls_meet() {
    let (mut deepest, mut fastest) = (0.0_f64, 0.0_f64);
    for degrees in (5..90).step_by(5) {
        let (sin, cos) = f64::from(degrees).to_radians().sin_cos();
        for phase in 0..10 {
            let away = 0.05 + 1e-3 * f64::from(phase);
            let start = [AT_RISER - away * cos, AT_RISER - away * sin, RADIUS];
            let mut ball =
                Roller::new(RADIUS, corner(), Config::default(), start).moving([2.0 * cos, 2.0 * sin, 0.0]);
            for _ in 0..200 {
                ball.step();
                let [x, y, _] = ball.position().to_array();
                deepest = deepest.max(x - AT_RISER).max(y - AT_RISER);
            }
            fastest = fastest.max(ball.velocity().norm());
        }
    }
    assert!(deepest < 1e-7 && fastest < 1e-6, "{deepest:e} m into a wall, goes on with {fastest:e} m/s");
}

/// Moves a ball at 2 m/s, its center at `height` \[m\], toward the upright edge at (1, 1) m from seventeen directions, up to 20 mm
/// aside; the deepest it gets into it.
fn deepest_into_the_edge(ground: &HeightField, height: f64, config: &Config) -> f64 {
    let mut deepest = 0.0_f64;
    for degrees in (5..90).step_by(5) {
        let (sin, cos) = f64::from(degrees).to_radians().sin_cos();
        for offset in [-0.02, -0.01, -0.001, 0.0, 0.001, 0.01, 0.02] {
            let start = [1.0 - 0.12 * cos - offset * sin, 1.0 - 0.12 * sin + offset * cos, height];
            let mut ball = Roller::new(RADIUS, ground.clone(), config.clone(), start).moving([
                2.0 * cos,
                2.0 * sin,
                0.0,
            ]);
            for _ in 0..60 {
                ball.step();
                let [x, y, z] = ball.position().to_array();
                let (out_x, out_y) = ((1.0 - x).max(0.0), (1.0 - y).max(0.0));
                assert!((z - height).abs() < 1e-9, "{degrees}°, {offset} m aside: climbed to {z}");
                deepest = deepest.max(RADIUS - out_x.hypot(out_y));
            }
        }
    }
    deepest
}

#[test]
fn the_upright_edge_of_a_box_is_felt() {
    let deepest = deepest_into_the_edge(&boxed(), RADIUS, &Config::default());
    assert!(deepest < 1e-7, "{deepest:e} m into a wall");
}

#[test]
fn so_is_one_that_rises_behind_lower_boxes() {
    let weightless = Config { gravity: [0.0; 3], ..Config::default() };
    // Own cell at 0, the two beside it at any height below the ball, the one across above it.
    for [beside_x, beside_y] in [[0.02, -0.1], [-0.1, 0.02], [0.02, 0.05], [0.05, 0.05], [-0.1, -0.1]] {
        let ground = cells(0.1, |column, row| {
            [[[0.0, beside_x], [beside_y, 0.35]][usize::from(row >= 10)][usize::from(column >= 10)]; 4]
        });
        let deepest = deepest_into_the_edge(&ground, 0.2, &weightless);
        assert!(deepest < 1e-7, "beside {beside_x} and {beside_y} m: {deepest:e} m into a wall");
    }
}

#[test]
fn a_wall_is_solid_up_to_half_a_meter_above_its_foot() {
    let ground = cells(0.1, |column, _| [if column >= 10 { 1.0 } else { 0.0 }; 4]);
    let weightless = Config { gravity: [0.0; 3], ..Config::default() };
    let end = |height: f64| {
        let mut ball = Roller::new(RADIUS, ground.clone(), weightless.clone(), [0.9, 0.55, height]);
        ball = ball.moving([2.0, 0.0, 0.0]);
        (0..60).for_each(|_| ball.step());
        ball.position()
    };
    assert!((end(0.49).x - AT_RISER).abs() < 1e-6);
    // Further up it passes into the wall, and is lifted out.
    let within = end(0.51);
    assert!(within.x > 1.0 && within.z > 0.6, "{within:?}");
}
