//! What is recorded of a trajectory, and MuJoCo's records.

use physics::State;
use spatial::{Lane, Vec3};

const GOLDEN: &str = include_str!("../golden/trajectories.txt");

/// The robot at one instant.
#[derive(Clone, Debug)]
pub(crate) struct Sample {
    /// Base origin in the world \[m\].
    pub(crate) position: [f64; 3],
    /// Attitude `q_wb`, w x y z.
    pub(crate) orientation: [f64; 4],
    /// Velocity of the base origin, world axes \[m/s\].
    pub(crate) velocity: [f64; 3],
    /// Angular velocity of the base, base axes \[rad/s\].
    pub(crate) angular_velocity: [f64; 3],
    /// Vertical force of the ground on the robot, mean since the last sample \[N\].
    pub(crate) vertical_force: f64,
    /// \[rad\]
    pub(crate) joints: Vec<f64>,
}

/// MuJoCo's samples of a scene.
pub(crate) fn golden(scene: &str) -> Vec<Sample> {
    recorded(GOLDEN, scene)
}

/// Samples of a scene in the text of such a file.
pub(crate) fn recorded(text: &str, scene: &str) -> Vec<Sample> {
    let header = format!("scene {scene}");
    let mut lines = text.lines().skip_while(|line| *line != header).skip(1).peekable();
    assert!(lines.peek().is_some(), "no scene {scene}");
    lines.take_while(|line| !line.starts_with("scene")).map(Sample::parse).collect()
}

impl Sample {
    fn parse(line: &str) -> Self {
        let numbers: Vec<f64> = line.split(' ').map(|number| number.parse().expect("a number")).collect();
        let three = |start: usize| [0, 1, 2].map(|i| numbers[start + i]);
        Self {
            position: three(0),
            orientation: [3, 4, 5, 6].map(|i| numbers[i]),
            velocity: three(7),
            angular_velocity: three(10),
            vertical_force: numbers[13],
            joints: numbers[14..].to_vec(),
        }
    }

    /// The state of the first lane.
    pub(crate) fn read<L: Lane>(state: &State<L>, vertical_force: f64) -> Self {
        let velocity = state.base_orientation.to_matrix() * state.base_linear_velocity;
        Self {
            position: state.base_position.get(0),
            orientation: state.base_orientation.get(0),
            velocity: velocity.get(0),
            angular_velocity: state.base_angular_velocity.get(0),
            vertical_force,
            joints: state.joint_position.iter().map(|q| q.get(0)).collect(),
        }
    }

    /// Puts every lane into this state, joints at rest.
    pub(crate) fn write<L: Lane>(&self, state: &mut State<L>) {
        state.base_position = Vec3::splat(self.position);
        for lane in 0..L::WIDTH {
            state.base_orientation.set(lane, self.orientation);
        }
        let velocity = Vec3::splat(self.velocity);
        state.base_linear_velocity = state.base_orientation.to_matrix().transpose_mul(velocity);
        state.base_angular_velocity = Vec3::splat(self.angular_velocity);
        state.joint_position = self.joints.iter().map(|&q| L::splat(q)).collect();
    }
}
