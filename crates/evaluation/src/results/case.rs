//! One case of a suite in `results.json`.

use std::fmt;

use serde::{Deserialize, Serialize};
use tasks::guidance::{Behavior, PULL_THRESHOLD_X_N, PULL_THRESHOLD_Y_N};

use crate::{
    criteria::Miss,
    measures::{reading::Readings, split::Split},
    statistics::wilson_interval,
};

/// How a case's force relates to those of the paper's training.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Group {
    /// Inside the ranges of the paper's training (blue in its figure 5).
    #[default]
    Trained,
    /// On a threshold of Table II (yellow).
    Edge,
    /// Outside the ranges of the paper's training (red). Supervisors here train with wider ones.
    Outside,
}

impl Group {
    /// All groups, in the order of tables and legends.
    pub const ALL: [Self; 3] = [Self::Trained, Self::Edge, Self::Outside];

    /// How a force \[N\] relates to the paper's training, f_x from −80 to 0 and f_y within ±40, and to Table II.
    pub fn of_force(force: [f32; 3]) -> Self {
        let [x, y] = [force[0], force[1].abs()];
        if !(-80.0..=0.0).contains(&x) || y > 40.0 {
            Self::Outside
        } else if x == -PULL_THRESHOLD_X_N || y == PULL_THRESHOLD_Y_N {
            Self::Edge
        } else {
            Self::Trained
        }
    }

    /// The name used in `results.json`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Trained => "trained",
            Self::Edge => "edge",
            Self::Outside => "outside",
        }
    }
}

impl fmt::Display for Group {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(self.name())
    }
}

/// One force and what the robot did under it, over all episodes.
///
/// Means run over all episodes of the case on the judged window; a fallen robot stands still from its fall on, so
/// every value is finite even when all episodes fell.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CaseResult {
    /// `f_x/f_y` in newtons, as in the paper's figure 5: "-60/30".
    pub name: String,
    /// Force along x of the heading frame \[N\]; below zero pulls back.
    pub fx: f64,
    /// Force along y of the heading frame \[N\]; above zero pulls left.
    pub fy: f64,
    /// How it relates to the forces of the paper's training.
    pub group: Group,
    /// What Table II makes of it.
    pub behavior: Behavior,
    /// Episodes run.
    pub episodes: usize,
    /// Episodes that met the criterion of their behavior.
    pub successes: usize,
    /// Episodes that ended in a fall.
    pub falls: usize,
    /// `successes / episodes`.
    pub success_rate: f64,
    /// Lower end of the 95 % Wilson interval of the success rate.
    pub wilson_low: f64,
    /// Upper end of the 95 % Wilson interval of the success rate.
    pub wilson_high: f64,
    /// Mean forward speed, base frame \[m/s\].
    pub mean_vx: f64,
    /// Mean sideways speed, base frame, left positive \[m/s\].
    pub mean_vy: f64,
    /// Mean yaw rate, counterclockwise positive \[rad/s\].
    pub mean_wz: f64,
    /// Mean size of the heading's unwanted change, scaled to ten seconds [degrees / 10 s]: 0 is perfect.
    pub heading_drift_deg_per_10s: f64,
    /// Mean planar speed \[m/s\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mean_planar_speed: Option<f64>,
    /// Mean largest distance from the window's first position \[m\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position_drift_m: Option<f64>,
    /// Mean behavior reward of the case, in [0, 1].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reward: Option<f64>,
    /// What the episodes looked like, by Table II's nearest behavior; fallen robots are not counted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub read_as: Option<Readings>,
    /// The episodes that did not obey, by what they lacked.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub misses: Vec<Miss>,
    /// The same episodes by the ground they were on and by their friction, where they differ in that.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub splits: Vec<Split>,
    /// Median time until half of the change of the command is given \[s\]; missing where Table II asks for no change, or half of
    /// the episodes never got there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub command_latency_50_s: Option<f64>,
    /// Median time until nine tenths of it are given \[s\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub command_latency_90_s: Option<f64>,
    /// Median time until the velocity has made nine tenths of the change \[s\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub velocity_latency_90_s: Option<f64>,
    /// Median time from the pull to the standstill \[s\], for stop and spin.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stopping_time_s: Option<f64>,
    /// Median way from the pull to the standstill \[m\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stopping_distance_m: Option<f64>,
    /// Mean number of changes between behaviors in ten seconds of the same force.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub switches_per_10s: Option<f64>,
    /// Mean largest horizontal force at the hand \[N\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hand_force_peak_n: Option<f64>,
    /// Mean largest change of that force in 0.1 s \[N/s\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hand_force_rate_nps: Option<f64>,
    /// Mean largest acceleration of the hand, from one half second to the next \[m/s²\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hand_acceleration_mps2: Option<f64>,
    /// Mean largest jerk of the hand, likewise \[m/s³\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hand_jerk_mps3: Option<f64>,
}

impl CaseResult {
    /// Fills the counts, the rate and its interval; the rest is left at its default, for struct update syntax.
    pub fn from_counts(episodes: usize, successes: usize, falls: usize) -> Self {
        let interval = wilson_interval(successes, episodes);
        let success_rate = if episodes == 0 { 0.0 } else { successes as f64 / episodes as f64 };
        let (wilson_low, wilson_high) = (interval.low, interval.high);
        Self { episodes, successes, falls, success_rate, wilson_low, wilson_high, ..Self::default() }
    }

    /// Every number by its key, for those who check or compare them.
    pub(crate) fn measures(&self) -> [(&'static str, Option<f64>); 22] {
        [
            ("fx", Some(self.fx)),
            ("fy", Some(self.fy)),
            ("success_rate", Some(self.success_rate)),
            ("wilson_low", Some(self.wilson_low)),
            ("wilson_high", Some(self.wilson_high)),
            ("mean_vx", Some(self.mean_vx)),
            ("mean_vy", Some(self.mean_vy)),
            ("mean_wz", Some(self.mean_wz)),
            ("heading_drift_deg_per_10s", Some(self.heading_drift_deg_per_10s)),
            ("mean_planar_speed", self.mean_planar_speed),
            ("position_drift_m", self.position_drift_m),
            ("reward", self.reward),
            ("command_latency_50_s", self.command_latency_50_s),
            ("command_latency_90_s", self.command_latency_90_s),
            ("velocity_latency_90_s", self.velocity_latency_90_s),
            ("stopping_time_s", self.stopping_time_s),
            ("stopping_distance_m", self.stopping_distance_m),
            ("switches_per_10s", self.switches_per_10s),
            ("hand_force_peak_n", self.hand_force_peak_n),
            ("hand_force_rate_nps", self.hand_force_rate_nps),
            ("hand_acceleration_mps2", self.hand_acceleration_mps2),
            ("hand_jerk_mps3", self.hand_jerk_mps3),
        ]
    }
}
