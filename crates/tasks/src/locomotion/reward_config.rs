//! The weights of what a walking robot is paid for ([`super::reward`]).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Weights of the terms, per second of simulated time (a step counts 0.02).
#[derive(Clone, Debug, PartialEq, JsonSchema, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RewardConfig {
    /// exp(−|e_xy|² / `tracking_variance`) \[1/s; 0 to 100\]. Source: Isaac Lab, 1.
    pub track_linear_velocity: f32,
    /// exp(−e_ω² / `tracking_variance`) \[1/s; 0 to 100\]. Source: Isaac Lab, 0.5.
    pub track_yaw_rate: f32,
    /// exp(−|e_xy|² / `fine_tracking_variance`) \[1/s; 0 to 100\]. Source: ours, the wide term hardly sees 0.1 m/s.
    pub track_linear_velocity_fine: f32,
    /// exp(−e_ω² / `fine_tracking_variance`) \[1/s; 0 to 100\]. Source: ours.
    pub track_yaw_rate_fine: f32,
    /// exp(−|ē|² / `mean_tracking_variance`), ē the running mean over half a second of the velocity's three errors since the
    /// command was given: what is left of them once the gait's swing is taken out \[1/s; 0 to 100\]. Source: ours.
    pub track_mean_velocity: f32,
    /// Squared error at which `track_mean_velocity` is down to 1/e \[m²/s² and rad²/s²; 0.000001 to 100\]. Source: ours.
    pub mean_tracking_variance: f32,
    /// Share of the commanded speed that is made along it, −1 to 1; 0 without one. It pulls evenly, where the others are
    /// flat, at those who go on but slowly, as on stairs \[1/s; 0 to 100\]. Source: ours.
    pub progress: f32,
    /// Share of the commanded yaw rate that is made, −1 to 1, while told to turn on the spot, for those whose feet are held
    /// by an edge \[1/s; 0 to 100\]. Source: ours.
    pub spin_progress: f32,
    /// Half the difference between the numbers of feet that carry on the one diagonal and on the other, unless told to
    /// stand: 1 in a trot, 0 in a bound, a pace or standing. Without it mirror-symmetric policies came to bound, and both
    /// front feet against a riser hold a robot fast \[1/s; 0 to 100\]. Source: ours.
    pub trot: f32,
    /// Squared error at which the wide tracking terms are down to 1/e \[m²/s² or rad²/s²; 0.000001 to 100\]. Source: Isaac
    /// Lab, 0.25.
    pub tracking_variance: f32,
    /// Squared error at which the fine tracking terms are down to 1/e \[m²/s² or rad²/s²; 0.000001 to 100\]. Source: ours;
    /// the behavior reward of the paper has 0.1.
    pub fine_tracking_variance: f32,
    /// v_z² \[s/m²; -100 to 0\]. Source: Isaac Lab, −2.
    pub vertical_velocity: f32,
    /// ω_x² + ω_y² \[s/rad²; -100 to 0\]. Source: Isaac Lab, −0.05.
    pub roll_pitch_rate: f32,
    /// Σ τ² \[1/(N² m² s); -100 to 0\]. Source: Isaac Lab, −1e-5 rough, −2.5e-5 flat.
    pub joint_torque: f32,
    /// Σ q̈² \[s³/rad²; -100 to 0\]. Source: Isaac Lab, −2.5e-7.
    pub joint_acceleration: f32,
    /// Σ (a − a')² \[1/s; -100 to 0\]. Source: Isaac Lab, −0.01; twice that is ours.
    pub action_rate: f32,
    /// Σ over feet that touch down (air time − `air_time_target_s`), unless told to stand \[1/s²; 0 to 100\]. Source: Isaac
    /// Lab, 0.125 rough, 0.5 flat.
    pub feet_air_time: f32,
    /// Swings longer than this are paid for, shorter ones fined \[s; 0 to 10\]. Source: Isaac Lab, 0.5; shorter steps stand a
    /// pull better.
    pub air_time_target_s: f32,
    /// Number of thighs, knees, shanks and hand in contact \[1/s; -100 to 0\]. Source: Isaac Lab, −1 (thighs).
    pub undesired_contact: f32,
    /// g_x² + g_y² \[1/s; -100 to 0\]. Source: Isaac Lab, 0 rough, −5 flat.
    pub flat_orientation: f32,
    /// Radians beyond 95 % of the joint ranges \[1/(rad s); -100 to 0\]. Source: Isaac Lab, 0; ours, −1.
    pub joint_limit: f32,
    /// Σ |q − q_default| while told to stand \[1/(rad s); -100 to 0\]. Source: ours.
    pub stand_still: f32,
    /// Number of feet that do not carry while told to stand: a walk that treads on the spot is turned by a pull from the
    /// side \[1/s; -100 to 0\]. Source: ours.
    pub lifted_foot: f32,
    /// Number of feet that the ground pushes sideways with more than 1.25 times what it carries, and more than 1 N: feet pressed
    /// against a riser, where robots get stuck and turn about them \[1/s; -100 to 0\]. Source: legged_gym, which has the term with
    /// a weight of 0; docs/findings.md, "Robots that get stuck".
    pub stumble: f32,
    /// Distance from where the command was given, at most 1 m, while told to stand or to turn on the spot: on stairs robots drift
    /// from their place under a pull, more slowly than their gait swings \[1/(m s); -100 to 0\]. Source: ours; docs/findings.md, "At the edge
    /// of what it can hold".
    pub displacement: f32,
    /// Paid once for a fall, not per second, and outside the sum that `only_positive` cuts off \[1; -1000 to 0\]. Source:
    /// ours.
    pub fall: f32,
    /// Strength of all terms but tracking, progress, the trot and the fall at the start of training: with all of it from the
    /// start standing still pays best, and stepping is not found \[1; 0 to 1\]. Source: docs/findings.md, "Standing trap".
    pub penalty_start: f32,
    /// Control steps until the strength `penalty_start` has grown to 1; only those count during which robots walk as told (`ramp_tracking`
    /// of the task) \[steps; 0 to 4294967295\]. Source: docs/findings.md, "Standing trap".
    pub penalty_ramp_steps: u32,
    /// Whether a sum below zero counts as zero: penalties then cannot make an early fall pay, but where they rule nothing can
    /// be learned. Source: legged_gym, true.
    pub only_positive: bool,
}

impl Default for RewardConfig {
    fn default() -> Self {
        Self {
            track_linear_velocity: 1.0,
            track_yaw_rate: 0.5,
            track_linear_velocity_fine: 0.5,
            track_yaw_rate_fine: 0.5,
            track_mean_velocity: 0.0,
            mean_tracking_variance: 0.01,
            progress: 0.0,
            spin_progress: 0.0,
            trot: 0.0,
            tracking_variance: 0.25,
            fine_tracking_variance: 0.05,
            vertical_velocity: -2.0,
            roll_pitch_rate: -0.05,
            joint_torque: -1e-5,
            joint_acceleration: -2.5e-7,
            action_rate: -0.02,
            feet_air_time: 0.25,
            air_time_target_s: 0.25,
            undesired_contact: -1.0,
            flat_orientation: -0.5,
            joint_limit: -1.0,
            stand_still: -0.03,
            lifted_foot: 0.0,
            stumble: 0.0,
            displacement: 0.0,
            fall: -1.0,
            penalty_start: 0.2,
            penalty_ramp_steps: 12_000,
            only_positive: false,
        }
    }
}
