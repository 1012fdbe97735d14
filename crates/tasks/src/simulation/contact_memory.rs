//! What happened to the contacts of a group of robots during a control step, watched at every physics step.

use robot::{BodyPart, RobotModel};
use spatial::{Vec3, f32x16};

use super::GROUP;
use crate::archive::{Archive, Archived};

/// A foot carries when the ground pushes with more than this \[N\]. Source: Isaac Lab, contact sensors.
pub const CONTACT_THRESHOLD_N: f32 = 1.0;
/// A foot stumbles when the ground pushes it sideways with more than so many times what it carries: on level ground friction alone
/// cannot, at most 1.25, so the push comes from a riser. Source: legged_gym's term of this name has 5, which a foot that hangs at a
/// riser by its friction never reaches.
const STUMBLE_RATIO: f32 = 1.25;

/// Contact spheres of a robot by what they stand for.
#[derive(Clone, Debug)]
pub struct ContactGroups {
    feet: Vec<usize>,
    base: Vec<usize>,
    leg: Vec<usize>,
    hand: Vec<usize>,
}

impl ContactGroups {
    /// Sorts the contacts of a robot; it must have four feet.
    pub fn new(robot: &RobotModel) -> Self {
        let leg = [BodyPart::Thigh, BodyPart::Knee, BodyPart::Shank];
        Self {
            feet: robot.contacts_of(BodyPart::Foot),
            base: robot.contacts_of(BodyPart::Base),
            leg: leg.into_iter().flat_map(|part| robot.contacts_of(part)).collect(),
            hand: robot.contacts_of(BodyPart::Hand),
        }
    }
}

/// Contacts of [`GROUP`] robots.
#[derive(Clone, Debug)]
pub struct ContactMemory {
    /// Time since each foot last carried \[s\]: 0 while it carries.
    pub air_time: [[f32; GROUP]; 4],
    /// Whether each foot carried in the last physics step.
    pub carries: [[bool; GROUP]; 4],
    /// Air time of the swing that ended in this control step \[s\]; negative if none did.
    pub touchdown: [[f32; GROUP]; 4],
    /// Whether each foot stumbled in this control step.
    pub stumbles: [[bool; GROUP]; 4],
    /// Largest force on any sphere of the base in this control step \[N\].
    pub base_force: [f32; GROUP],
    /// Thighs, knees and shanks that touched anything in this control step.
    pub legs_touching: [f32; GROUP],
    /// Largest force of the ground on the hand in this control step \[N\].
    pub hand_force: [f32; GROUP],
    leg_force: Vec<f32x16>,
}

impl ContactMemory {
    /// Nothing has touched yet.
    pub fn new(groups: &ContactGroups) -> Self {
        Self {
            air_time: [[0.0; GROUP]; 4],
            carries: [[false; GROUP]; 4],
            touchdown: [[-1.0; GROUP]; 4],
            stumbles: [[false; GROUP]; 4],
            base_force: [0.0; GROUP],
            legs_touching: [0.0; GROUP],
            hand_force: [0.0; GROUP],
            leg_force: vec![f32x16::ZERO; groups.leg.len()],
        }
    }

    /// Forgets a robot that was reset.
    pub fn forget(&mut self, lane: usize) {
        for foot in 0..4 {
            self.air_time[foot][lane] = 0.0;
            self.carries[foot][lane] = false;
            self.touchdown[foot][lane] = -1.0;
        }
    }

    /// Starts a control step.
    pub fn begin(&mut self) {
        self.touchdown = [[-1.0; GROUP]; 4];
        self.stumbles = [[false; GROUP]; 4];
        self.base_force = [0.0; GROUP];
        self.hand_force = [0.0; GROUP];
        self.leg_force.fill(f32x16::ZERO);
    }

    /// Takes in the contact forces of a physics step of `dt` \[s\].
    pub fn observe(&mut self, groups: &ContactGroups, force: &[Vec3<f32x16>], dt: f32) {
        for (foot, &sphere) in groups.feet.iter().take(4).enumerate() {
            let Vec3 { x, y, z } = force[sphere];
            let norm = force[sphere].norm();
            let least = (z * f32x16::splat(STUMBLE_RATIO)).max(f32x16::splat(CONTACT_THRESHOLD_N));
            let pressed = x * x + y * y - least * least;
            for lane in 0..GROUP {
                self.stumbles[foot][lane] |= pressed.as_array()[lane] > 0.0;
                let carries = norm.as_array()[lane] > CONTACT_THRESHOLD_N;
                let air_time = &mut self.air_time[foot][lane];
                if carries {
                    if *air_time > 0.0 {
                        self.touchdown[foot][lane] = *air_time;
                    }
                    *air_time = 0.0;
                } else {
                    *air_time += dt;
                }
                self.carries[foot][lane] = carries;
            }
        }
        self.base_force = largest(&groups.base, force, self.base_force);
        self.hand_force = largest(&groups.hand, force, self.hand_force);
        for (most, &sphere) in self.leg_force.iter_mut().zip(&groups.leg) {
            *most = most.max(force[sphere].norm());
        }
    }

    /// Ends a control step.
    pub fn end(&mut self) {
        self.legs_touching = [0.0; GROUP];
        for force in &self.leg_force {
            for (count, &force) in self.legs_touching.iter_mut().zip(force.as_array()) {
                *count += f32::from(u8::from(force > CONTACT_THRESHOLD_N));
            }
        }
    }
}

fn largest(spheres: &[usize], force: &[Vec3<f32x16>], before: [f32; GROUP]) -> [f32; GROUP] {
    let most = spheres.iter().fold(f32x16::new(before), |most, &sphere| most.max(force[sphere].norm()));
    *most.as_array()
}

impl Archived for ContactMemory {
    fn visit(&mut self, archive: &mut impl Archive) {
        for foot in 0..4 {
            archive.f32s(&mut self.air_time[foot]);
            for carries in &mut self.carries[foot] {
                archive.flag(carries);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use spatial::Lane;

    use super::*;

    #[test]
    fn a_swing_is_timed_and_reported_when_it_ends() {
        let robot = robot::anymal_d();
        let groups = ContactGroups::new(&robot);
        let mut memory = ContactMemory::new(&groups);
        let mut force = vec![Vec3::zero(); robot.contacts.len()];
        memory.begin();
        for _ in 0..3 {
            memory.observe(&groups, &force, 0.005);
        }
        assert!((memory.air_time[0][0] - 0.015).abs() < 1e-6);
        assert_eq!(memory.touchdown[0][0], -1.0);
        force[0] = Vec3::splat([0.0, 0.0, 100.0]);
        memory.observe(&groups, &force, 0.005);
        memory.end();
        assert!((memory.touchdown[0][7] - 0.015).abs() < 1e-6);
        assert!(memory.carries[0][0] && !memory.carries[1][0]);
        assert_eq!(memory.legs_touching[0], 0.0);
        assert!(!memory.stumbles[0][7], "it only carries");
        // Pressed against a riser in one of two physics steps: 100 N sideways and 79 N of friction.
        memory.begin();
        force[0] = Vec3::splat([80.0, 60.0, 79.0]);
        memory.observe(&groups, &force, 0.005);
        force[0] = Vec3::splat([0.0, 0.0, 100.0]);
        memory.observe(&groups, &force, 0.005);
        assert!(memory.stumbles[0][7] && !memory.stumbles[1][7]);
        // A knee and the base.
        let knee = robot.contacts_of(BodyPart::Knee)[2];
        let base = robot.contacts_of(BodyPart::Base)[0];
        force[knee].x = f32x16::from_fn(|lane| if lane == 3 { 2.0 } else { 0.5 });
        force[base].z = f32x16::from_fn(|lane| lane as f64);
        memory.begin();
        memory.observe(&groups, &force, 0.005);
        memory.end();
        assert_eq!(memory.touchdown[0][0], -1.0);
        assert_eq!((memory.legs_touching[3], memory.legs_touching[2]), (1.0, 0.0));
        assert_eq!(memory.base_force[9], 9.0);
    }
}
