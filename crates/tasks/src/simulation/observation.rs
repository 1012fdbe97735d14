//! What a robot senses, and the noise on it.

use policy::layout;
use spatial::{Philox, Quat};

use super::{Group, Simulation};

/// Largest error of each kind of sensor, uniform on both sides. Source: Isaac Lab, `velocity_env_cfg.py`.
const LINEAR_VELOCITY_NOISE: f32 = 0.1;
const ANGULAR_VELOCITY_NOISE: f32 = 0.2;
const GRAVITY_NOISE: f32 = 0.05;
const JOINT_POSITION_NOISE: f32 = 0.01;
const JOINT_VELOCITY_NOISE: f32 = 1.5;
const SCAN_NOISE: f32 = 0.1;

/// One robot's base motion, as its own sensors would give it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BaseMotion {
    /// Velocity of the base origin in the base frame \[m/s\].
    pub linear_velocity: [f32; 3],
    /// Angular velocity in the base frame \[rad/s\].
    pub angular_velocity: [f32; 3],
    /// Unit vector of gravity in the base frame.
    pub gravity: [f32; 3],
    /// Position of the base origin in the world \[m\].
    pub position: [f32; 3],
    /// Heading: yaw of the base's x axis on the ground \[rad\].
    pub yaw: f32,
}

impl Group {
    /// Motion of one robot's base.
    pub fn base_motion(&self, lane: usize) -> BaseMotion {
        let state = &self.block.state;
        let [w, x, y, z] = state.base_orientation.get(lane);
        let r_wb = Quat { w, x, y, z }.to_matrix();
        let [a, b, c] = r_wb.columns;
        BaseMotion {
            linear_velocity: state.base_linear_velocity.get(lane).map(|v| v as f32),
            angular_velocity: state.base_angular_velocity.get(lane).map(|v| v as f32),
            gravity: [-a.z as f32, -b.z as f32, -c.z as f32],
            position: state.base_position.get(lane).map(|v| v as f32),
            yaw: a.y.atan2(a.x) as f32,
        }
    }

    /// Appends a robot's pose to `out`: position of the base \[m\], its attitude as w, x, y, z, joint positions \[rad\].
    pub fn write_pose(&self, lane: usize, out: &mut Vec<f32>) {
        let state = &self.block.state;
        out.extend(state.base_position.get(lane).map(|x| x as f32));
        out.extend(state.base_orientation.get(lane).map(|q| q as f32));
        out.extend(state.joint_position.iter().map(|q| q.as_array()[lane]));
    }
}

impl Simulation {
    /// Fills what both observation layouts share except the middle part: base motion, joints, height scan.
    ///
    /// `scan` is where the layout has its height scan. `noise` scales the sensors' errors; with 0 nothing is drawn.
    pub fn sense(
        &self,
        group: &Group,
        lane: usize,
        noise: f32,
        random: &mut Philox,
        scan: layout::Segment,
        out: &mut [f32],
    ) {
        let motion = group.base_motion(lane);
        out[layout::BASE_LINEAR_VELOCITY.range()].copy_from_slice(&motion.linear_velocity);
        out[layout::BASE_ANGULAR_VELOCITY.range()].copy_from_slice(&motion.angular_velocity);
        out[layout::PROJECTED_GRAVITY.range()].copy_from_slice(&motion.gravity);
        let state = &group.block.state;
        for j in 0..layout::JOINTS {
            let position = state.joint_position[j].as_array()[lane];
            out[layout::JOINT_POSITION.offset + j] = position - self.default_joint_position[j];
            out[layout::JOINT_VELOCITY.offset + j] = state.joint_velocity[j].as_array()[lane];
        }
        let [x, y, z] = motion.position;
        self.engine.terrain().scan(x, y, motion.yaw, z, &mut out[scan.range()]);
        if noise > 0.0 {
            let segments = [
                (layout::BASE_LINEAR_VELOCITY, LINEAR_VELOCITY_NOISE),
                (layout::BASE_ANGULAR_VELOCITY, ANGULAR_VELOCITY_NOISE),
                (layout::PROJECTED_GRAVITY, GRAVITY_NOISE),
                (layout::JOINT_POSITION, JOINT_POSITION_NOISE),
                (layout::JOINT_VELOCITY, JOINT_VELOCITY_NOISE),
                (scan, SCAN_NOISE),
            ];
            for (segment, amplitude) in segments {
                for value in &mut out[segment.range()] {
                    *value += noise * random.uniform(-amplitude, amplitude);
                }
            }
            // Limited again, as noise may lead out of ±1. Isaac Lab limits only after it: what is far beyond shows none there.
            for value in &mut out[scan.range()] {
                *value = value.clamp(-1.0, 1.0);
            }
        }
    }
}
