//! A film of one episode as a GIF, drawn here: no window, no graphics card.

mod canvas;

use gif::{Encoder, EncodingError, Frame, Repeat};
use terrain::HeightField;

use canvas::Canvas;

/// Size of the picture.
const SIZE: [usize; 2] = [400, 260];
/// Control steps from one picture to the next: 0.08 s.
pub const FRAME_STEPS: usize = 4;
/// The same in the format's hundredths of a second.
const FRAME_HUNDREDTHS: u16 = 8;
/// Where the camera stands: behind the robot's first heading by this angle \[rad\], so far away, so high \[m\].
const CAMERA_ANGLE: f32 = 2.5;
const CAMERA_DISTANCE: f32 = 3.3;
const CAMERA_HEIGHT: f32 = 1.7;
/// Focal length \[pixels\].
const FOCAL: f32 = 420.0;
/// Lines on the ground: this far apart, and this far around the robot \[m\].
const LINE_GAP: f32 = 0.5;
const LINE_REACH: f32 = 4.0;
/// Length of the arrow of a force \[m/N\].
const ARROW: f32 = 0.015;

/// Red, green, blue of each color.
const PALETTE: [[u8; 3]; 10] = [
    [236, 240, 244], // sky and ground
    [196, 204, 212], // lines on the ground
    [168, 176, 186], // shadow
    [43, 98, 168],   // the way it went
    [120, 126, 134], // legs on the far side
    [60, 66, 74],    // legs
    [214, 60, 50],   // force
    [226, 168, 40],  // body
    [40, 44, 50],    // bar and feet
    [180, 69, 90],   // hand
];
const GROUND: u8 = 0;
const LINES: u8 = 1;
const SHADOW: u8 = 2;
const WAY: u8 = 3;
const FAR: u8 = 4;
const LEG: u8 = 5;
const FORCE: u8 = 6;
const BODY: u8 = 7;
const BAR: u8 = 8;
const HAND: u8 = 9;

/// What is to be seen of a robot at one moment; places in the world \[m\].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pose {
    /// Base origin.
    pub base: [f32; 3],
    /// Heading \[rad\].
    pub yaw: f32,
    /// Hip, knee and foot of each leg: left front, left hind, right front, right hind.
    pub legs: [[[f32; 3]; 3]; 4],
    /// The hand.
    pub hand: [f32; 3],
    /// Force of the hand, heading frame \[N\].
    pub force: [f32; 3],
}

/// A robot's film, one pose every [`FRAME_STEPS`] control steps.
///
/// # Errors
/// There is no pose.
pub fn film(poses: &[Pose], ground: &HeightField) -> Result<Vec<u8>, String> {
    let first = poses.first().ok_or("a film needs at least one pose")?;
    let mut bytes = Vec::new();
    let mut camera = Camera::new(first);
    let [width, height] = SIZE.map(|length| length as u16);
    let encode = |bytes: &mut Vec<u8>, camera: &mut Camera| -> Result<(), EncodingError> {
        let mut encoder = Encoder::new(bytes, width, height, PALETTE.as_flattened())?;
        encoder.set_repeat(Repeat::Infinite)?;
        for (index, pose) in poses.iter().enumerate() {
            camera.follow(pose);
            let picture = draw(pose, &poses[..index], ground, camera);
            let mut frame = Frame::from_indexed_pixels(width, height, picture.pixels, None);
            frame.delay = FRAME_HUNDREDTHS;
            encoder.write_frame(&frame)?;
        }
        Ok(())
    };
    encode(&mut bytes, &mut camera).map_err(|error| error.to_string())?;
    Ok(bytes)
}

/// Stands beside the robot and goes along, without turning.
struct Camera {
    target: [f32; 3],
    /// Unit vectors to the right, up and away, world.
    axes: [[f32; 3]; 3],
    offset: [f32; 3],
}

impl Camera {
    fn new(pose: &Pose) -> Self {
        let (sin, cos) = (pose.yaw + CAMERA_ANGLE).sin_cos();
        let offset = [CAMERA_DISTANCE * cos, CAMERA_DISTANCE * sin, CAMERA_HEIGHT];
        let length = norm(offset);
        let away = offset.map(|x| -x / length);
        let flat = away[0].hypot(away[1]);
        let right = [away[1] / flat, -away[0] / flat, 0.0];
        Self { target: pose.base, axes: [right, cross(right, away), away], offset }
    }

    fn follow(&mut self, pose: &Pose) {
        for (target, base) in self.target.iter_mut().zip(pose.base) {
            *target += 0.25 * (base - *target);
        }
    }

    /// Pixel and depth \[m\]; `None` behind the camera.
    fn project(&self, point: [f32; 3]) -> Option<([f32; 2], f32)> {
        let from: [f32; 3] = std::array::from_fn(|i| point[i] - self.target[i] - self.offset[i]);
        let [x, y, depth] = self.axes.map(|axis| dot(axis, from));
        let [width, height] = SIZE.map(|length| length as f32);
        (depth > 0.2).then(|| ([0.5 * width + FOCAL * x / depth, 0.45 * height - FOCAL * y / depth], depth))
    }
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn norm(a: [f32; 3]) -> f32 {
    dot(a, a).sqrt()
}

/// A part of the robot: ends, thickness \[m\], color.
struct Part {
    ends: [[f32; 3]; 2],
    radius: [f32; 2],
    color: u8,
}

fn draw(pose: &Pose, before: &[Pose], ground: &HeightField, camera: &Camera) -> Canvas {
    let mut canvas = Canvas::new(SIZE[0], SIZE[1], GROUND);
    draw_ground(&mut canvas, pose, ground, camera);
    let on_ground = |point: [f32; 3]| [point[0], point[1], ground.height(point[0], point[1])];
    for pair in before.windows(2) {
        draw_part(&mut canvas, camera, &part(pair[0].base, pair[1].base, [0.012; 2], WAY), on_ground);
    }
    let mut parts = parts(pose);
    for part in &parts {
        draw_part(&mut canvas, camera, &Part { color: SHADOW, ..*part }, on_ground);
    }
    let depth = |part: &Part| -> f32 {
        part.ends.iter().filter_map(|end| camera.project(*end)).map(|(_, depth)| depth).sum()
    };
    parts.sort_by(|a, b| depth(b).total_cmp(&depth(a)));
    let body = body(pose);
    let middle = 2.0 * camera.project(pose.base).map_or(0.0, |(_, depth)| depth);
    let (far, near): (Vec<&Part>, Vec<&Part>) = parts.iter().partition(|part| depth(part) > middle);
    far.iter().for_each(|part| draw_part(&mut canvas, camera, part, |point| point));
    let corners: Vec<[f32; 2]> =
        body.iter().filter_map(|corner| camera.project(*corner)).map(|(p, _)| p).collect();
    canvas.hull(&corners, BODY);
    near.iter().for_each(|part| draw_part(&mut canvas, camera, part, |point| point));
    draw_force(&mut canvas, pose, camera);
    canvas
}

fn draw_ground(canvas: &mut Canvas, pose: &Pose, ground: &HeightField, camera: &Camera) {
    const PIECE: f32 = 0.1;
    let lines = (2.0 * LINE_REACH / LINE_GAP) as i32;
    let pieces = (2.0 * LINE_REACH / PIECE) as i32;
    let start = [0, 1].map(|i| ((pose.base[i] - LINE_REACH) / LINE_GAP).round() * LINE_GAP);
    for axis in 0..2 {
        for line in 0..=lines {
            let place = |piece: i32| {
                let (across, along) = (line as f32 * LINE_GAP, piece as f32 * PIECE);
                let [x, y] = if axis == 0 { [across, along] } else { [along, across] };
                let (x, y) = (start[0] + x, start[1] + y);
                [x, y, ground.height(x, y)]
            };
            for piece in 0..pieces {
                let part = part(place(piece), place(piece + 1), [0.006; 2], LINES);
                draw_part(canvas, camera, &part, |point| point);
            }
        }
    }
}

fn part(from: [f32; 3], to: [f32; 3], radius: [f32; 2], color: u8) -> Part {
    Part { ends: [from, to], radius, color }
}

fn draw_part(canvas: &mut Canvas, camera: &Camera, part: &Part, place: impl Fn([f32; 3]) -> [f32; 3]) {
    let [Some((a, depth_a)), Some((b, depth_b))] = part.ends.map(|end| camera.project(place(end))) else {
        return;
    };
    let radius =
        [FOCAL * part.radius[0] / depth_a, FOCAL * part.radius[1] / depth_b].map(|r: f32| r.max(0.55));
    canvas.capsule([a, b], radius, part.color);
}

/// Legs, bar and hand.
fn parts(pose: &Pose) -> Vec<Part> {
    let mut parts = Vec::new();
    for (leg, [hip, knee, foot]) in pose.legs.iter().enumerate() {
        // The camera stands on the left behind the robot's first heading.
        let color = if leg < 2 { LEG } else { FAR };
        parts.push(part(*hip, *knee, [0.07, 0.05], color));
        parts.push(part(*knee, *foot, [0.045, 0.025], color));
        parts.push(part(*foot, *foot, [0.035; 2], BAR));
    }
    let (sin, cos) = pose.yaw.sin_cos();
    let [x, y, z] = pose.base;
    let start = [x - 0.45 * cos, y - 0.45 * sin, z + 0.1];
    parts.push(part(start, pose.hand, [0.014; 2], BAR));
    parts.push(part(pose.hand, pose.hand, [0.05; 2], HAND));
    parts
}

/// Corners of the body: around the hips, from below them to above.
fn body(pose: &Pose) -> Vec<[f32; 3]> {
    let middle: [f32; 3] = std::array::from_fn(|i| pose.legs.iter().map(|leg| leg[0][i]).sum::<f32>() / 4.0);
    let corner = |leg: &[[f32; 3]; 3]| {
        let out: [f32; 3] = std::array::from_fn(|i| middle[i] + 1.15 * (leg[0][i] - middle[i]));
        [[out[0], out[1], out[2] - 0.04], [out[0], out[1], out[2] + 0.17]]
    };
    pose.legs.iter().flat_map(corner).collect()
}

fn draw_force(canvas: &mut Canvas, pose: &Pose, camera: &Camera) {
    let (sin, cos) = pose.yaw.sin_cos();
    let [x, y, z] = pose.force;
    let world = [cos * x - sin * y, sin * x + cos * y, z];
    if norm(world) < 1.0 {
        return;
    }
    let tip: [f32; 3] = std::array::from_fn(|i| pose.hand[i] + ARROW * world[i]);
    draw_part(canvas, camera, &part(pose.hand, tip, [0.018; 2], FORCE), |point| point);
    let head: [f32; 3] = std::array::from_fn(|i| tip[i] + 0.13 * world[i] / norm(world));
    draw_part(canvas, camera, &part(tip, head, [0.055, 0.002], FORCE), |point| point);
}

#[cfg(test)]
mod tests {
    use std::f32::consts::TAU;

    use super::*;

    fn standing(yaw: f32) -> Pose {
        let leg = |x: f32, y: f32| [[x, y, 0.55], [x, 1.2 * y, 0.3], [x, 1.2 * y, 0.03]];
        Pose {
            base: [0.0, 0.0, 0.55],
            yaw,
            legs: [leg(0.35, 0.15), leg(-0.35, 0.15), leg(0.35, -0.15), leg(-0.35, -0.15)],
            hand: [-1.2, 0.0, 0.87],
            force: [-60.0, 0.0, 0.0],
        }
    }

    #[test]
    fn a_film_can_be_read_back_and_shows_a_robot_and_its_force() {
        let ground = HeightField::flat(0.0);
        let poses = [standing(0.0), standing(0.1), standing(0.2)];
        let bytes = film(&poses, &ground).unwrap();
        let mut options = gif::DecodeOptions::new();
        options.set_color_output(gif::ColorOutput::Indexed);
        let mut decoder = options.read_info(bytes.as_slice()).unwrap();
        let mut frames = 0;
        while let Some(frame) = decoder.read_next_frame().unwrap() {
            frames += 1;
            assert_eq!(
                (usize::from(frame.width), usize::from(frame.height), frame.delay),
                (SIZE[0], SIZE[1], 8)
            );
            let count = |color: u8| frame.buffer.iter().filter(|pixel| **pixel == color).count();
            assert!(count(BODY) > 1000 && count(FORCE) > 100 && count(LINES) > 1000 && count(SHADOW) > 100);
        }
        assert_eq!(frames, 3);
        assert!(film(&[], &ground).is_err());
    }

    #[test]
    fn the_camera_sees_left_on_the_left_when_it_looks_ahead() {
        // Turned so that the camera stands straight behind.
        let camera = Camera::new(&Pose { yaw: TAU / 2.0 - CAMERA_ANGLE, ..Pose::default() });
        let at = |point| camera.project(point).unwrap().0;
        let [middle_x, middle_y] = at([0.0; 3]);
        assert!(at([0.0, 1.0, 0.0])[0] < middle_x - 50.0);
        assert!(at([0.0, 0.0, 1.0])[1] < middle_y - 50.0);
        assert!(at([1.0, 0.0, 0.0])[1] < middle_y);
        assert_eq!(camera.project([-10.0, 0.0, 0.0]), None);
    }
}
