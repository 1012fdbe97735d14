//! What a walking robot is paid for: one term, one small function; weights in the configuration.
//!
//! Terms and weights start from Isaac Lab's velocity task (`velocity_env_cfg.py`, ANYmal D flat and rough). Added: the fine
//! tracking terms, since the wide ones hardly distinguish 0.1 m/s of error while a supervisor's behavior reward does;
//! standing still; a price on falling.

use super::RewardConfig;
use crate::{bounds::within, simulation::BaseMotion};

/// What the terms are computed from.
#[derive(Clone, Copy, Debug)]
pub struct StepQuantities<'a> {
    /// Motion of the base after the step.
    pub motion: BaseMotion,
    /// Commanded v_x, v_y \[m/s\], ω_z \[rad/s\].
    pub command: [f32; 3],
    /// Squared length of the running mean of the velocity less that; (m/s)² and (rad/s)² alike.
    pub mean_error: f32,
    /// Distance on the plane from where the command was given \[m\].
    pub displacement: f32,
    /// Joint positions minus default \[rad\].
    pub joint_offset: &'a [f32; 12],
    /// Change of joint velocities over the control step, divided by it \[rad/s²\].
    pub joint_acceleration: &'a [f32; 12],
    /// Torques at the end of the step \[N m\].
    pub joint_torque: &'a [f32; 12],
    /// How far joints are beyond 95 % of their range \[rad\], summed.
    pub joint_excess: f32,
    /// Raw action of this step.
    pub action: &'a [f32; 12],
    /// Raw action of the step before.
    pub previous_action: &'a [f32; 12],
    /// Per foot, air time of a swing that ended \[s\]; negative if none did.
    pub touchdown: [f32; 4],
    /// Whether each foot carries; LF, LH, RF, RH.
    pub carries: [bool; 4],
    /// Whether each foot is pressed against a riser.
    pub stumbles: [bool; 4],
    /// Thighs, knees, shanks and hand that touched something.
    pub undesired_contacts: f32,
}

/// Number of terms.
pub const TERMS: usize = 21;
/// The first of them pay for going as told; the rest grow with [`RewardConfig::penalty_scale_at`].
const PAYING_TERMS: usize = 8;

type Value = fn(&StepQuantities<'_>, &RewardConfig) -> f32;
type Term = (&'static str, fn(&RewardConfig) -> f32, Value);

/// Every term: its name, its weight, its value.
const TERM_TABLE: [Term; TERMS] = [
    (
        "track_linear_velocity",
        |w| w.track_linear_velocity,
        |q, w| (-linear_error(q) / w.tracking_variance).exp(),
    ),
    ("track_yaw_rate", |w| w.track_yaw_rate, |q, w| (-yaw_error(q) / w.tracking_variance).exp()),
    (
        "track_linear_velocity_fine",
        |w| w.track_linear_velocity_fine,
        |q, w| (-linear_error(q) / w.fine_tracking_variance).exp(),
    ),
    (
        "track_yaw_rate_fine",
        |w| w.track_yaw_rate_fine,
        |q, w| (-yaw_error(q) / w.fine_tracking_variance).exp(),
    ),
    (
        "track_mean_velocity",
        |w| w.track_mean_velocity,
        |q, w| (-q.mean_error / w.mean_tracking_variance).exp(),
    ),
    ("progress", |w| w.progress, |q, _| progress(q)),
    ("spin_progress", |w| w.spin_progress, |q, _| spin_progress(q)),
    ("trot", |w| w.trot, |q, _| trot(q)),
    ("vertical_velocity", |w| w.vertical_velocity, |q, _| square(q.motion.linear_velocity[2])),
    ("roll_pitch_rate", |w| w.roll_pitch_rate, |q, _| squares(&q.motion.angular_velocity[..2])),
    ("joint_torque", |w| w.joint_torque, |q, _| squares(q.joint_torque)),
    ("joint_acceleration", |w| w.joint_acceleration, |q, _| squares(q.joint_acceleration)),
    ("action_rate", |w| w.action_rate, |q, _| action_rate(q)),
    ("feet_air_time", |w| w.feet_air_time, feet_air_time),
    ("undesired_contact", |w| w.undesired_contact, |q, _| q.undesired_contacts),
    ("flat_orientation", |w| w.flat_orientation, |q, _| squares(&q.motion.gravity[..2])),
    ("joint_limit", |w| w.joint_limit, |q, _| q.joint_excess),
    ("stand_still", |w| w.stand_still, |q, _| stand_still(q)),
    ("lifted_foot", |w| w.lifted_foot, |q, _| lifted_feet(q)),
    ("stumble", |w| w.stumble, |q, _| q.stumbles.iter().filter(|&&stumbles| stumbles).count() as f32),
    ("displacement", |w| w.displacement, |q, _| displacement(q)),
];

/// Names of the terms, in the order of [`RewardConfig::terms`].
pub fn term_names() -> [&'static str; TERMS] {
    TERM_TABLE.map(|(name, ..)| name)
}

impl RewardConfig {
    /// Weighted terms of a step of `dt` \[s\]; all but those that pay for going as told are scaled by `penalty_scale`.
    pub fn terms(&self, q: &StepQuantities<'_>, penalty_scale: f32, dt: f32) -> [f32; TERMS] {
        let mut terms = TERM_TABLE.map(|(_, weight, value)| {
            let weight = weight(self);
            if weight == 0.0 { 0.0 } else { weight * value(q, self) * dt }
        });
        terms[PAYING_TERMS..].iter_mut().for_each(|term| *term *= penalty_scale);
        terms
    }

    /// Strength of the penalties when a share `grown` (0 to 1) of the ramp is over.
    pub fn penalty_scale_at(&self, grown: f32) -> f32 {
        self.penalty_start + (1.0 - self.penalty_start) * grown
    }

    /// The reward of a step: the sum of the terms, and the price of a fall.
    pub fn total(&self, terms: &[f32; TERMS], fell: bool) -> f32 {
        let sum: f32 = terms.iter().sum();
        let earned = if self.only_positive { sum.max(0.0) } else { sum };
        if fell { earned + self.fall } else { earned }
    }

    /// Checks the weights.
    ///
    /// # Errors
    /// Names the first one out of range.
    pub fn validate(&self) -> Result<(), String> {
        for (index, (name, weight, _)) in TERM_TABLE.into_iter().enumerate() {
            let is_reward = index < PAYING_TERMS || name == "feet_air_time";
            let [low, high] = if is_reward { [0.0, 100.0] } else { [-100.0, 0.0] };
            within(&format!("reward.{name}"), weight(self), low, high)?;
        }
        within("reward.tracking_variance", self.tracking_variance, 1e-6, 100.0)?;
        within("reward.fine_tracking_variance", self.fine_tracking_variance, 1e-6, 100.0)?;
        within("reward.mean_tracking_variance", self.mean_tracking_variance, 1e-6, 100.0)?;
        within("reward.air_time_target_s", self.air_time_target_s, 0.0, 10.0)?;
        within("reward.penalty_start", self.penalty_start, 0.0, 1.0)?;
        within("reward.fall", self.fall, -1000.0, 0.0)
    }
}

fn square(x: f32) -> f32 {
    x * x
}

fn squares(values: &[f32]) -> f32 {
    values.iter().map(|x| x * x).sum()
}

/// Squared error of the velocity along the ground.
pub(super) fn linear_error(q: &StepQuantities<'_>) -> f32 {
    let v = q.motion.linear_velocity;
    square(q.command[0] - v[0]) + square(q.command[1] - v[1])
}

/// Squared error of the yaw rate.
pub(super) fn yaw_error(q: &StepQuantities<'_>) -> f32 {
    square(q.command[2] - q.motion.angular_velocity[2])
}

fn is_told_to_travel(q: &StepQuantities<'_>) -> bool {
    squares(&q.command[..2]) > 0.01
}

fn progress(q: &StepQuantities<'_>) -> f32 {
    let ([x, y, _], [v_x, v_y, _]) = (q.command, q.motion.linear_velocity);
    if is_told_to_travel(q) { ((x * v_x + y * v_y) / (square(x) + square(y))).clamp(-1.0, 1.0) } else { 0.0 }
}

fn spin_progress(q: &StepQuantities<'_>) -> f32 {
    let is_told_to_spin = is_told_to_move(q) && !is_told_to_travel(q);
    if is_told_to_spin { (q.motion.angular_velocity[2] / q.command[2]).clamp(-1.0, 1.0) } else { 0.0 }
}

fn is_told_to_move(q: &StepQuantities<'_>) -> bool {
    squares(&q.command) > 0.01
}

fn action_rate(q: &StepQuantities<'_>) -> f32 {
    q.action.iter().zip(q.previous_action).map(|(a, b)| square(a - b)).sum()
}

fn feet_air_time(q: &StepQuantities<'_>, config: &RewardConfig) -> f32 {
    let landed = q.touchdown.iter().filter(|&&time| time >= 0.0);
    if is_told_to_move(q) { landed.map(|time| time - config.air_time_target_s).sum() } else { 0.0 }
}

fn trot(q: &StepQuantities<'_>) -> f32 {
    let [left_front, left_hind, right_front, right_hind] = q.carries.map(i8::from);
    let difference = left_front + right_hind - left_hind - right_front;
    if is_told_to_move(q) { 0.5 * f32::from(difference.abs()) } else { 0.0 }
}

fn stand_still(q: &StepQuantities<'_>) -> f32 {
    if is_told_to_move(q) { 0.0 } else { q.joint_offset.iter().map(|offset| offset.abs()).sum() }
}

fn lifted_feet(q: &StepQuantities<'_>) -> f32 {
    if is_told_to_move(q) { 0.0 } else { q.carries.iter().filter(|&&carries| !carries).count() as f32 }
}

fn displacement(q: &StepQuantities<'_>) -> f32 {
    if is_told_to_travel(q) { 0.0 } else { q.displacement.min(1.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quantities() -> StepQuantities<'static> {
        StepQuantities {
            motion: BaseMotion {
                linear_velocity: [0.5, 0.0, 0.1],
                angular_velocity: [0.2, -0.1, 0.3],
                gravity: [0.1, 0.0, -0.995],
                position: [0.0; 3],
                yaw: 0.0,
            },
            command: [1.0, 0.0, 0.3],
            mean_error: 0.02,
            displacement: 0.3,
            joint_offset: &[0.1; 12],
            joint_acceleration: &[10.0; 12],
            joint_torque: &[20.0; 12],
            joint_excess: 0.2,
            action: &[1.0; 12],
            previous_action: &[0.5; 12],
            touchdown: [0.7, -1.0, -1.0, 0.4],
            carries: [false, false, false, true],
            stumbles: [true, false, true, false],
            undesired_contacts: 2.0,
        }
    }

    #[test]
    fn every_term_by_hand() {
        let unit = RewardConfig {
            track_linear_velocity: 1.0,
            track_yaw_rate: 1.0,
            track_linear_velocity_fine: 1.0,
            track_yaw_rate_fine: 1.0,
            track_mean_velocity: 1.0,
            mean_tracking_variance: 0.01,
            progress: 1.0,
            spin_progress: 1.0,
            trot: 1.0,
            tracking_variance: 0.25,
            fine_tracking_variance: 0.05,
            vertical_velocity: 1.0,
            roll_pitch_rate: 1.0,
            joint_torque: 1.0,
            joint_acceleration: 1.0,
            action_rate: 1.0,
            feet_air_time: 1.0,
            air_time_target_s: 0.5,
            undesired_contact: 1.0,
            flat_orientation: 1.0,
            joint_limit: 1.0,
            stand_still: 1.0,
            lifted_foot: 1.0,
            stumble: 1.0,
            displacement: 1.0,
            fall: -3.0,
            penalty_start: 1.0,
            penalty_ramp_steps: 0,
            only_positive: false,
        };
        let expected = [
            (-1.0_f32).exp(),
            1.0,
            (-5.0_f32).exp(),
            1.0,
            (-2.0_f32).exp(),
            0.5,
            0.0,
            0.5,
            0.01,
            0.05,
            4800.0,
            1200.0,
            3.0,
            0.1,
            2.0,
            0.01,
            0.2,
            0.0,
            0.0,
            2.0,
            0.0,
        ];
        for ((name, value), expected) in
            term_names().iter().zip(unit.terms(&quantities(), 1.0, 1.0)).zip(expected)
        {
            assert!(
                (value - expected).abs() < 1e-5 * (1.0 + expected),
                "{name}: {value}, expected {expected}"
            );
        }
        let still = StepQuantities { command: [0.0; 3], touchdown: [0.9; 4], ..quantities() };
        let terms = unit.terms(&still, 1.0, 1.0);
        assert!((terms[17] - 1.2).abs() < 1e-5);
        assert_eq!(terms[18], 3.0, "one foot of four carries");
        assert_eq!(terms[5..8], [0.0; 3], "told to stand neither progress nor a trot is paid for");
        assert_eq!(terms[13], 0.0, "nor air time");
        assert_eq!(terms[20], 0.3, "but to be elsewhere costs");
        let spin = StepQuantities { command: [0.0, 0.0, 0.6], displacement: 1.7, ..quantities() };
        assert_eq!(unit.terms(&spin, 1.0, 1.0)[20], 1.0, "at most a metre");
        let gentle = unit.terms(&still, 0.5, 1.0);
        assert_eq!((gentle[1], gentle[17]), (terms[1], 0.5 * terms[17]), "tracking keeps its strength");
    }

    #[test]
    fn progress_is_of_what_one_is_told() {
        let told = |command| StepQuantities { command, ..quantities() };
        let paid = |q: &StepQuantities<'_>| (progress(q), spin_progress(q));
        assert_eq!(paid(&told([2.0, 0.0, 0.6])), (0.25, 0.0), "a quarter of the speed");
        assert_eq!(paid(&told([0.0, 0.0, 0.6])), (0.0, 0.5), "half of the yaw rate, on the spot");
        assert_eq!(paid(&told([0.0, 0.0, -0.2])), (0.0, -1.0), "the wrong way round");
        assert_eq!(paid(&told([0.0; 3])), (0.0, 0.0), "told to stand");
    }

    #[test]
    fn only_a_trot_is_paid_in_full() {
        let pattern = |carries: [bool; 4]| trot(&StepQuantities { carries, ..quantities() });
        assert_eq!(pattern([true, false, false, true]), 1.0);
        assert_eq!(pattern([false, true, true, false]), 1.0, "the other diagonal");
        assert_eq!(pattern([false, true, false, true]), 0.0, "a bound");
        assert_eq!(pattern([true, true, false, false]), 0.0, "a pace");
        assert_eq!(pattern([true, true, false, true]), 0.5, "one foot lifted");
        assert_eq!((pattern([true; 4]), pattern([false; 4])), (0.0, 0.0), "standing, flying");
    }

    #[test]
    fn totals_by_hand() {
        let mut terms = [0.0; TERMS];
        (terms[0], terms[1], terms[8]) = (0.02, 0.01, -0.05);
        let total = |only_positive, fell| {
            RewardConfig { only_positive, fall: -2.0, ..RewardConfig::default() }.total(&terms, fell)
        };
        assert!((total(false, false) + 0.02).abs() < 1e-6);
        assert_eq!(total(true, false), 0.0);
        assert_eq!(total(true, true), -2.0);
    }
}
