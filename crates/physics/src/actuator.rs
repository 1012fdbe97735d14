//! Joint servos: PD behind the speed–torque limit of a DC motor, linearized for an implicit step.
//!
//! Source of the law: `DCMotor` of Isaac Lab (`actuators/actuator_pd.py`, late 2024):
//! τ* = kp (q_des − q) − kd q̇, limited to what the motor gives at q̇:
//! τ_max = clamp(τ_sat (1 − q̇/q̇_lim), 0, τ_lim), τ_min = clamp(τ_sat (−1 − q̇/q̇_lim), −τ_lim, 0).

use spatial::{Lane, Mask};

use crate::engine::Actuator;

/// A torque that is affine in the joint's velocity at the end of the step: τ = constant − damping · q̇.
///
/// Each of the law's branches is affine, so taking its damping implicitly is exact within a branch and stable for any kd:
/// kd dt / I reaches 0.9 at a shank, and the motor's own slope of 16 N m s/rad more than that. The spring is explicit: by
/// itself a joint of inertia I is stable while dt² kp < 2 (2 I + dt kd), for any I while dt kp ≤ 2 kd (the default: 0.4 and
/// 4 N m s/rad). The branch is that of the velocity at the beginning, and nothing is clamped at the end: a step that
/// changes the velocity by Δq̇ ends damping · |Δq̇| further along the line, which may be beyond the effort limit and,
/// if it turns a joint around on the motor's slope, beyond the stall torque.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AffineTorque<L> {
    pub(crate) constant: L,
    pub(crate) damping: L,
}

/// The branch of the law that holds at position `q` and velocity `qd`.
#[inline(always)]
pub(crate) fn affine_torque<L: Lane>(
    actuator: &Actuator,
    stiffness: L,
    damping: L,
    target: L,
    q: L,
    qd: L,
) -> AffineTorque<L> {
    let saturation = L::splat(actuator.saturation_torque);
    let effort = L::splat(actuator.effort_limit);
    let slope = L::splat(actuator.saturation_torque / actuator.velocity_limit);
    let spring = stiffness * (target - q);
    let servo = damping.neg_mul_add(qd, spring);

    let upper_line = slope.neg_mul_add(qd, saturation);
    let lower_line = slope.neg_mul_add(qd, -saturation);
    let upper = upper_line.clamp(L::zero(), effort);
    let lower = lower_line.clamp(-effort, L::zero());

    let above = servo.gt(upper);
    let below = servo.lt(lower);
    // On the sloping part of the limit the line itself is the torque; on the flat parts a constant.
    let on_upper_line = above.and(upper_line.lt(effort)).and(upper_line.gt(L::zero()));
    let on_lower_line = below.and(lower_line.gt(-effort)).and(lower_line.lt(L::zero()));

    let constant = above.select(upper, below.select(lower, spring));
    let constant = on_upper_line.select(saturation, on_lower_line.select(-saturation, constant));
    let limited = above.or(below);
    let damping = limited.select(L::zero(), damping);
    let damping = on_upper_line.or(on_lower_line).select(slope, damping);
    AffineTorque { constant, damping }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::Config;

    /// The law as published, explicit.
    fn law(a: &Actuator, target: f64, q: f64, qd: f64) -> f64 {
        let servo = a.stiffness * (target - q) - a.damping * qd;
        let upper = (a.saturation_torque * (1.0 - qd / a.velocity_limit)).clamp(0.0, a.effort_limit);
        let lower = (a.saturation_torque * (-1.0 - qd / a.velocity_limit)).clamp(-a.effort_limit, 0.0);
        servo.clamp(lower, upper)
    }

    #[test]
    fn at_its_own_velocity_the_affine_torque_is_the_law() {
        let a = Config::default().actuator;
        for i in 0..60 {
            for k in 0..60 {
                let (target, qd) = (f64::from(i) * 0.1 - 3.0, f64::from(k) * 0.4 - 12.0);
                let t = affine_torque(&a, a.stiffness, a.damping, target, 0.1, qd);
                let torque = t.constant - t.damping * qd;
                assert!(
                    (torque - law(&a, target, 0.1, qd)).abs() < 1e-9,
                    "target {target} qd {qd}: {torque}"
                );
            }
        }
    }

    #[test]
    fn known_points_of_the_motor_curve() {
        let a = Config::default().actuator;
        let torque = |target: f64, qd: f64| {
            let t = affine_torque(&a, a.stiffness, a.damping, target, 0.0, qd);
            t.constant - t.damping * qd
        };
        assert_eq!(torque(10.0, 0.0), 80.0);
        assert_eq!(torque(10.0, 2.5), 80.0);
        assert!((torque(10.0, 5.0) - 40.0).abs() < 1e-12);
        assert_eq!(torque(10.0, 7.5), 0.0);
        assert_eq!(torque(-10.0, 0.0), -80.0);
        assert_eq!(torque(0.5, 0.0), 40.0);
    }
}
