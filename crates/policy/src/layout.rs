//! What stands where in an observation, and how its left–right mirror image looks.

use crate::environment::Mirror;

/// Part of an observation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Segment {
    /// Name, as in the metadata of exported policies.
    pub name: &'static str,
    /// First entry.
    pub offset: usize,
    /// Number of entries.
    pub len: usize,
}

impl Segment {
    /// The entries' indices.
    pub const fn range(self) -> std::ops::Range<usize> {
        self.offset..self.offset + self.len
    }
}

/// Points of the height scan along x (fast index) and y.
pub const SCAN_SHAPE: [usize; 2] = [17, 11];
/// Entries of a locomotion observation.
pub const LOCOMOTION_OBSERVATION: usize = 235;
/// Entries of a supervisor observation.
pub const SUPERVISOR_OBSERVATION: usize = 226;
/// Joints, and entries of a locomotion action.
pub const JOINTS: usize = 12;
/// Entries of a velocity command: v_x, v_y \[m/s\], ω_z \[rad/s\].
pub const COMMAND: usize = 3;

const fn segment(name: &'static str, offset: usize, len: usize) -> Segment {
    Segment { name, offset, len }
}

/// Base linear velocity \[m/s\], base frame; in both layouts.
pub const BASE_LINEAR_VELOCITY: Segment = segment("base_linear_velocity", 0, 3);
/// Base angular velocity \[rad/s\], base frame; in both layouts.
pub const BASE_ANGULAR_VELOCITY: Segment = segment("base_angular_velocity", 3, 3);
/// Unit vector of gravity in the base frame; in both layouts.
pub const PROJECTED_GRAVITY: Segment = segment("projected_gravity", 6, 3);
/// Velocity command of the locomotion policy.
pub const VELOCITY_COMMAND: Segment = segment("velocity_command", 9, COMMAND);
/// Force of the hand \[N\], heading frame; stands where the locomotion policy has its command.
pub const HARNESS_FORCE: Segment = segment("harness_force", 9, 3);
/// Joint position minus default \[rad\]; in both layouts.
pub const JOINT_POSITION: Segment = segment("joint_position", 12, JOINTS);
/// Joint velocity \[rad/s\]; in both layouts.
pub const JOINT_VELOCITY: Segment = segment("joint_velocity", 24, JOINTS);
/// Previous raw action of the locomotion policy.
pub const PREVIOUS_ACTION: Segment = segment("previous_action", 36, JOINTS);
/// Previous command of the supervisor, as limited.
pub const PREVIOUS_COMMAND: Segment = segment("previous_command", 36, COMMAND);
/// Height scan of the locomotion layout.
pub const LOCOMOTION_SCAN: Segment = segment("height_scan", 48, 187);
/// Height scan of the supervisor layout.
pub const SUPERVISOR_SCAN: Segment = segment("height_scan", 39, 187);

/// The locomotion observation: the layout of Isaac Lab's ANYmal D rough task.
pub const LOCOMOTION: [Segment; 8] = [
    BASE_LINEAR_VELOCITY,
    BASE_ANGULAR_VELOCITY,
    PROJECTED_GRAVITY,
    VELOCITY_COMMAND,
    JOINT_POSITION,
    JOINT_VELOCITY,
    PREVIOUS_ACTION,
    LOCOMOTION_SCAN,
];

/// The supervisor observation.
pub const SUPERVISOR: [Segment; 8] = [
    BASE_LINEAR_VELOCITY,
    BASE_ANGULAR_VELOCITY,
    PROJECTED_GRAVITY,
    HARNESS_FORCE,
    JOINT_POSITION,
    JOINT_VELOCITY,
    PREVIOUS_COMMAND,
    SUPERVISOR_SCAN,
];

const VECTOR: [f32; 3] = [1.0, -1.0, 1.0];
const AXIAL: [f32; 3] = [-1.0, 1.0, -1.0];
const PLANAR: [f32; 3] = [1.0, -1.0, -1.0];

/// Mirror of a locomotion observation and action.
pub fn locomotion_mirror() -> Mirror {
    Mirror { observation: mirror_observation(&LOCOMOTION), action: mirror_joints(0) }
}

/// Mirror of a supervisor observation and action.
pub fn supervisor_mirror() -> Mirror {
    Mirror { observation: mirror_observation(&SUPERVISOR), action: mirror_vector(0, PLANAR) }
}

fn mirror_observation(layout: &[Segment]) -> Vec<(usize, f32)> {
    let mirrored = |segment: &Segment| match segment.name {
        "base_linear_velocity" | "projected_gravity" | "harness_force" => {
            mirror_vector(segment.offset, VECTOR)
        }
        "base_angular_velocity" => mirror_vector(segment.offset, AXIAL),
        "velocity_command" | "previous_command" => mirror_vector(segment.offset, PLANAR),
        "height_scan" => mirror_scan(segment.offset),
        _ => mirror_joints(segment.offset),
    };
    layout.iter().flat_map(mirrored).collect()
}

fn mirror_vector(offset: usize, signs: [f32; 3]) -> Vec<(usize, f32)> {
    signs.into_iter().enumerate().map(|(i, sign)| (offset + i, sign)).collect()
}

/// Legs LF, LH, RF, RH change sides; the hip's abduction also changes sign.
fn mirror_joints(offset: usize) -> Vec<(usize, f32)> {
    let joint = |j: usize| (offset + 4 * (j / 4) + (j + 2) % 4, if j < 4 { -1.0 } else { 1.0 });
    (0..JOINTS).map(joint).collect()
}

fn mirror_scan(offset: usize) -> Vec<(usize, f32)> {
    let [along, across] = SCAN_SHAPE;
    let point = |i: usize| (offset + (across - 1 - i / along) * along + i % along, 1.0);
    (0..along * across).map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_follow_one_another() {
        for (layout, total) in [(LOCOMOTION, LOCOMOTION_OBSERVATION), (SUPERVISOR, SUPERVISOR_OBSERVATION)] {
            let mut next = 0;
            for segment in layout {
                assert_eq!(segment.offset, next, "{}", segment.name);
                next += segment.len;
            }
            assert_eq!(next, total);
        }
    }

    #[test]
    fn mirrored_twice_is_the_original() {
        for mirror in [locomotion_mirror(), supervisor_mirror()] {
            for map in [mirror.observation, mirror.action] {
                for (i, &(source, sign)) in map.iter().enumerate() {
                    assert_eq!(map[source], (i, sign));
                }
            }
        }
    }

    #[test]
    fn left_becomes_right() {
        let mirror = locomotion_mirror();
        // LF_HAA is the mirror of RF_HAA with its sign changed; LH_KFE of RH_KFE.
        assert_eq!(mirror.action[0], (2, -1.0));
        assert_eq!(mirror.action[9], (11, 1.0));
        // The first scan row (y = −0.5 m) comes from the last (y = +0.5 m).
        assert_eq!(mirror.observation[LOCOMOTION_SCAN.offset], (LOCOMOTION_SCAN.offset + 170, 1.0));
        assert_eq!(mirror.observation[10], (10, -1.0));
        assert_eq!(mirror.observation[5], (5, -1.0));
    }
}
