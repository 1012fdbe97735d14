//! What can be seen of robots in training, for pictures: read between two steps, and nothing is changed by it.

use std::sync::Arc;

use terrain::HeightField;

use crate::simulation::Group;

/// What [`View::write_view`] writes of a robot, by name and width: position of the base \[m\], its attitude as w, x, y, z, joint
/// positions \[rad\]; the velocity command and the base's velocity in its place, v_x, v_y \[m/s\], ω_z \[rad/s\]; the forces
/// on hand and base \[N\], heading frame. `observed_force` is what the hand exerts, without the sensor's error that a supervisor in
/// training sees; it has the name of the page's own field.
pub const VIEW_FIELDS: [(&str, usize); 7] = [
    ("position", 3),
    ("orientation", 4),
    ("joints", 12),
    ("command", 3),
    ("velocity", 3),
    ("observed_force", 3),
    ("base_force", 3),
];

/// Environments that can be looked at.
pub trait View {
    /// The ground they all are on.
    fn ground(&self) -> &Arc<HeightField>;
    /// Simulated time of a step \[s\].
    fn step_s(&self) -> f32;
    /// Appends the [`VIEW_FIELDS`] of a robot as it is now.
    fn write_view(&self, robot: usize, out: &mut Vec<f32>);
}

impl Group {
    /// Appends the [`VIEW_FIELDS`] of a robot that is under `command`.
    pub(crate) fn write_view(&self, lane: usize, command: [f32; 3], out: &mut Vec<f32>) {
        self.write_pose(lane, out);
        let motion = self.base_motion(lane);
        let [v_x, v_y, _] = motion.linear_velocity;
        let input = &self.block.input;
        out.extend(command);
        out.extend([v_x, v_y, motion.angular_velocity[2]]);
        for force in [&input.hand_force, &input.base_force] {
            out.extend(force.get(lane).map(|newtons| newtons as f32));
        }
    }
}

#[cfg(test)]
mod tests {
    use policy::{StepBuffers, VecEnv};

    use super::*;
    use crate::{
        guidance::{GuidanceConfig, GuidanceEnv, LocomotionPolicy, test_policy},
        locomotion::{LocomotionConfig, LocomotionEnv, Terrain},
    };

    fn views(env: &(impl VecEnv + View)) -> Vec<Vec<f32>> {
        (0..env.num_envs())
            .map(|robot| {
                let mut out = Vec::new();
                env.write_view(robot, &mut out);
                out
            })
            .collect()
    }

    fn field(view: &[f32], name: &str) -> Vec<f32> {
        let at = VIEW_FIELDS.iter().position(|(field, _)| *field == name).unwrap();
        let start: usize = VIEW_FIELDS[..at].iter().map(|(_, width)| width).sum();
        view[start..start + VIEW_FIELDS[at].1].to_vec()
    }

    /// What is seen is what the observation without errors says.
    fn agrees(
        env: &mut (impl VecEnv + View),
        command: std::ops::Range<usize>,
        force: Option<std::ops::Range<usize>>,
    ) {
        let (robots, width) = (env.num_envs(), env.observation_dim());
        let mut buffers = StepBuffers::new(robots, width);
        env.reset(&mut buffers.observations);
        env.step(&vec![0.1; robots * env.action_dim()], &mut buffers);
        for (view, seen) in views(env).iter().zip(buffers.observations.chunks_exact(width)) {
            assert_eq!(view.len(), VIEW_FIELDS.iter().map(|(_, width)| width).sum::<usize>());
            assert_eq!(field(view, "command"), seen[command.clone()]);
            if let Some(force) = &force {
                assert_eq!(field(view, "observed_force"), seen[force.clone()]);
            }
            let velocity = field(view, "velocity");
            let observed = &seen[policy::layout::BASE_LINEAR_VELOCITY.range()];
            assert!((velocity[0] - observed[0]).abs() < 1e-5, "{velocity:?} {observed:?}");
            let [x, y, z] = field(view, "position").try_into().unwrap();
            let height = z - env.ground().height(x, y);
            assert!((0.2..0.9).contains(&height), "{height} m above the ground");
        }
    }

    #[test]
    fn what_is_seen_is_what_the_policies_observe() {
        use policy::layout;
        let config = LocomotionConfig {
            terrain: Terrain::Flat,
            observation_noise: 0.0,
            ..LocomotionConfig::default()
        };
        let mut env = LocomotionEnv::new(config, 32, 5).unwrap();
        agrees(&mut env, layout::VELOCITY_COMMAND.range(), None);
        assert_eq!(env.step_s(), 0.02);
        let mut config =
            GuidanceConfig { terrain: Terrain::Flat, observation_noise: 0.0, ..GuidanceConfig::default() };
        config.pull.noise_n = [0.0; 3];
        let policy = LocomotionPolicy::new(test_policy()).unwrap();
        let mut env = GuidanceEnv::new(config, policy, 32, 5).unwrap();
        agrees(&mut env, layout::PREVIOUS_COMMAND.range(), Some(layout::HARNESS_FORCE.range()));
        assert_eq!(env.step_s(), 0.1);
    }
}
