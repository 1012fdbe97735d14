//! The check both environments are put to: what a robot's left–right mirror image does and observes is the mirror image of what the
//! robot does and observes, as [`VecEnv::mirror`] says.

use std::sync::Arc;

use policy::{Mirror, StepBuffers, VecEnv, layout};
use spatial::{Philox, Purpose, Quat};
use terrain::HeightField;

use crate::simulation::{GROUP, Group};

/// Robots.
pub(crate) const ENVS: usize = GROUP;
/// Joints are LF, LH, RF, RH for HAA, then for HFE, then for KFE: legs change sides, and what turns outward (HAA) its sign.
const ON_THE_OTHER_SIDE: [(usize, f64); layout::JOINTS] = [
    (2, -1.0),
    (3, -1.0),
    (0, -1.0),
    (1, -1.0),
    (6, 1.0),
    (7, 1.0),
    (4, 1.0),
    (5, 1.0),
    (10, 1.0),
    (11, 1.0),
    (8, 1.0),
    (9, 1.0),
];
/// A height above the ground \[m\], and the largest differences there that are no mistake, of joint velocities \[rad/s\] and of
/// everything else: no robot is quite its own mirror image, and contacts are solved leg by leg.
const CASES: [(f64, f32, f32); 2] = [(1.0, 0.01, 0.005), (0.55, 0.3, 0.02)];

/// Ground that tells ahead from behind and left from right: it rises forward by a tenth and to the left by a fifth; mirrored where `side`
/// is −1.
pub(crate) fn slope(side: f32) -> Arc<HeightField> {
    let cells = 80;
    let (cell_size, corner) = (0.1, -4.0);
    let height = |column: usize, row: usize| {
        let [x, y] = [column, row].map(|index| corner + cell_size * index as f32);
        0.1 * x + 0.2 * side * y
    };
    let cell = |index: usize| {
        let (column, row) = (index % cells, index / cells);
        [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(right, up)| height(column + right, row + up))
    };
    let cells_on_it = (0..cells * cells).map(cell).collect();
    Arc::new(HeightField { cell_size, origin: [corner; 2], columns: cells, rows: cells, cells: cells_on_it })
}

/// Puts a robot into a random state `above` the slope \[m\].
fn place(group: &mut Group, lane: usize, side: f64, above: f64) {
    let mut random = Philox::new(5, lane, 0, 0, Purpose::Reset);
    let mut around = |width: f32| f64::from(random.uniform(-width, width));
    let [x, y] = [0; 2].map(|_| around(0.5));
    let [roll, pitch, yaw] = [around(0.15), around(0.15), around(3.0)];
    let Quat { w, x: i, y: j, z: k } = Quat::from_roll_pitch_yaw(roll, pitch, yaw);
    let ([v_x, v_y, v_z], [w_x, w_y, w_z]) = ([0; 3].map(|_| around(0.5)), [0; 3].map(|_| around(0.5)));
    let [f_x, f_y, f_z] = [0; 3].map(|_| around(60.0));
    let joints: [[f64; 2]; layout::JOINTS] = std::array::from_fn(|_| [around(0.2), around(2.0)]);
    let default = robot::anymal_d_default_joint_position();
    let state = &mut group.block.state;
    state.base_position.set(lane, [x, side * y, 0.1 * x + 0.2 * y + above]);
    state.base_orientation.set(lane, [w, side * i, j, side * k]);
    state.base_linear_velocity.set(lane, [v_x, side * v_y, v_z]);
    state.base_angular_velocity.set(lane, [side * w_x, w_y, side * w_z]);
    for (joint, (other, sign)) in ON_THE_OTHER_SIDE.into_iter().enumerate() {
        let (source, sign) = if side > 0.0 { (joint, 1.0) } else { (other, sign) };
        let [offset, rate] = joints[source].map(|value| (sign * value) as f32);
        state.joint_position[joint].as_mut_array()[lane] = default[joint] as f32 + offset;
        state.joint_velocity[joint].as_mut_array()[lane] = rate;
    }
    group.block.input.base_force.set(lane, [f_x, side * f_y, f_z]);
    group.block.forget_contacts(lane);
}

/// Steps robots of an environment of [`ENVS`] on a [`slope`] and their images in the mirrored environment, which `make` makes where it is
/// told −1 instead of 1; sensors do not err, and what robots are told and pulled by is mirrored. `set` is told the same, after the reset.
pub(crate) fn a_mirror_image_stays_one<E: VecEnv>(
    make: impl Fn(f32) -> E,
    group: impl Fn(&mut E) -> &mut Group,
    set: impl Fn(&mut E, f32),
) {
    for (above, of_rates, of_others) in CASES {
        let run = |side: f32| {
            let mut env = make(side);
            let mut buffers = StepBuffers::new(ENVS, env.observation_dim());
            env.reset(&mut buffers.observations);
            (0..ENVS).for_each(|lane| place(group(&mut env), lane, f64::from(side), above));
            set(&mut env, side);
            let mirror = env.mirror().expect("the task is symmetric");
            let mut random = Philox::new(5, 0, 0, 0, Purpose::Action);
            let width = env.action_dim();
            let mut actions: Vec<f32> = (0..ENVS * width).map(|_| random.uniform(-0.3, 0.3)).collect();
            if side < 0.0 {
                for action in actions.chunks_exact_mut(width) {
                    let original = action.to_vec();
                    Mirror::apply(&mirror.action, &original, action);
                }
            }
            env.step(&actions, &mut buffers);
            assert!(buffers.terminated.iter().all(|fell| !fell), "{above} m above the ground");
            (buffers, mirror)
        };
        let ((original, mirror), (image, _)) = (run(1.0), run(-1.0));
        let width = mirror.observation.len();
        for (robot, (original, image)) in
            original.observations.chunks_exact(width).zip(image.observations.chunks_exact(width)).enumerate()
        {
            let mut expected = vec![0.0; width];
            Mirror::apply(&mirror.observation, original, &mut expected);
            for (entry, (found, expected)) in image.iter().zip(&expected).enumerate() {
                let is_rate = layout::JOINT_VELOCITY.range().contains(&entry);
                let tolerance = if is_rate { of_rates } else { of_others };
                assert!(
                    (found - expected).abs() < tolerance,
                    "{above} m above the ground, robot {robot}, entry {entry}: {found}, expected {expected}"
                );
            }
        }
        assert!(original.rewards.iter().zip(&image.rewards).all(|(a, b)| (a - b).abs() < 1e-4));
    }
}
