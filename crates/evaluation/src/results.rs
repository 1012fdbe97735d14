//! `results.json`: what an evaluation found, for programs and for the report.
//!
//! The key names are a contract with every reader outside this repository: fields are added, never renamed. Keys this
//! version does not know are skipped on read, so an old program reads a newer file.

use std::fmt;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use policy::write_atomic;
use serde::{Deserialize, Serialize};
pub use tasks::guidance::Behavior;
use tasks::guidance::PAPER_TOTAL;

use crate::statistics::{mean, wilson_interval};

/// How a case's force relates to the forces seen in training.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Group {
    /// Inside the training range (blue in the paper's figure 5).
    #[default]
    Trained,
    /// On a threshold of Table II (yellow).
    Edge,
    /// Beyond the training range (red).
    Outside,
}

impl Group {
    /// All groups, in the order of tables and legends.
    pub const ALL: [Self; 3] = [Self::Trained, Self::Edge, Self::Outside];

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
    /// Whether training saw such a force.
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
}

impl CaseResult {
    /// Fills the counts, the rate and its interval; the rest is left at its default, for struct update syntax.
    pub fn from_counts(episodes: usize, successes: usize, falls: usize) -> Self {
        let interval = wilson_interval(successes, episodes);
        let success_rate = if episodes == 0 { 0.0 } else { successes as f64 / episodes as f64 };
        let (wilson_low, wilson_high) = (interval.low, interval.high);
        Self { episodes, successes, falls, success_rate, wilson_low, wilson_high, ..Self::default() }
    }

    fn measures(&self) -> [(&'static str, Option<f64>); 12] {
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
        ]
    }
}

/// The behavior reward over the paper's force ranges: the total and each behavior's share of it.
///
/// A share is the behavior's sum divided by all scheduled steps, so it is at most about 0.25 and the four add up to
/// the total.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BehaviorReward {
    /// Mean over all scheduled steps, in [0, 1].
    pub total: f64,
    /// Share of the steps labelled stop.
    pub stop: f64,
    /// Share of the steps labelled walk.
    pub walk: f64,
    /// Share of the steps labelled turn.
    pub turn: f64,
    /// Share of the steps labelled spin.
    pub spin: f64,
}

impl BehaviorReward {
    /// The paper's figures: read from its text, means over training with exploration noise after 3000 iterations.
    /// Its total and its four shares, which sum to 0.59, are not the same average.
    pub const PAPER: Self = Self {
        total: PAPER_TOTAL,
        stop: Behavior::Stop.paper_share(),
        walk: Behavior::Walk.paper_share(),
        turn: Behavior::Turn.paper_share(),
        spin: Behavior::Spin.paper_share(),
    };

    /// The share of one behavior.
    pub fn share(&self, behavior: Behavior) -> f64 {
        match behavior {
            Behavior::Walk => self.walk,
            Behavior::Stop => self.stop,
            Behavior::Turn => self.turn,
            Behavior::Spin => self.spin,
        }
    }
}

/// All that one run of `guidedog evaluate` found.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Results {
    /// Name of the suite: "paper17", "mirror17", ...
    pub suite: String,
    /// Kind of ground: "flat", "rough", "stairs".
    pub ground: String,
    /// Terrain level of every tile, 0 for flat ground.
    pub level: usize,
    /// Whether robot, friction and harness were drawn anew for each episode.
    pub randomize: bool,
    /// Episodes for each case.
    pub episodes: usize,
    /// Seed of all random draws.
    pub seed: u64,
    /// The locomotion policy judged: a file name.
    pub locomotion: String,
    /// The supervisor judged: a file name, "oracle", "rules" or "dominance".
    pub supervisor: String,
    /// One entry for each case, in the suite's order.
    pub cases: Vec<CaseResult>,
    /// Behavior reward of the judged supervisor, without exploration noise.
    pub reward: BehaviorReward,
    /// Behavior reward of the oracle over the same forces and seeds.
    pub oracle_reward: BehaviorReward,
}

/// Why results could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum ResultsError {
    /// The file could not be read or written.
    #[error("{path}: {source}", path = .path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The file holds something other than results.
    #[error("{path} is not a results.json: {source}", path = .path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// Where and what.
        source: serde_json::Error,
    },
    /// JSON has no word for NaN or infinity, so such a value would be lost.
    #[error("case {case}: {measure} is {value}, it must be finite")]
    NotFinite {
        /// Name of the case.
        case: String,
        /// Key of the measure.
        measure: &'static str,
        /// The value found.
        value: f64,
    },
}

impl Results {
    /// Mean success rate over the cases of a group, each case weighing the same; `None` if the suite has none.
    pub fn group_success(&self, group: Group) -> Option<f64> {
        let rates: Vec<f64> =
            self.cases.iter().filter(|c| c.group == group).map(|c| c.success_rate).collect();
        mean(&rates)
    }

    /// The case of this name.
    pub fn case(&self, name: &str) -> Option<&CaseResult> {
        self.cases.iter().find(|case| case.name == name)
    }

    /// The case with the lowest success rate.
    pub fn worst_case(&self) -> Option<&CaseResult> {
        self.cases.iter().min_by(|a, b| a.success_rate.total_cmp(&b.success_rate))
    }

    /// Reads a `results.json`.
    ///
    /// # Errors
    /// The file is missing, or lacks a key of the contract.
    pub fn read(path: &Path) -> Result<Self, ResultsError> {
        let text =
            fs::read_to_string(path).map_err(|source| ResultsError::File { path: path.into(), source })?;
        serde_json::from_str(&text).map_err(|source| ResultsError::Format { path: path.into(), source })
    }

    /// Writes a `results.json`; an interrupted write leaves the old file as it was.
    ///
    /// # Errors
    /// A measure is not finite, or the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), ResultsError> {
        self.check_finite()?;
        let mut text = serde_json::to_string_pretty(self)
            .map_err(|source| ResultsError::Format { path: path.into(), source })?;
        text.push('\n');
        write_atomic(path, text.as_bytes()).map_err(|source| ResultsError::File { path: path.into(), source })
    }

    fn check_finite(&self) -> Result<(), ResultsError> {
        for case in &self.cases {
            for (measure, value) in case.measures() {
                if let Some(value) = value.filter(|v| !v.is_finite()) {
                    return Err(ResultsError::NotFinite { case: case.name.clone(), measure, value });
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Results {
        let case = |name: &str, group, successes| CaseResult {
            name: name.into(),
            group,
            behavior: Behavior::Spin,
            ..CaseResult::from_counts(10, successes, 1)
        };
        Results {
            suite: "paper17".into(),
            cases: vec![
                case("-60/30", Group::Trained, 10),
                case("a", Group::Trained, 5),
                case("b", Group::Edge, 7),
            ],
            reward: BehaviorReward::PAPER,
            ..Results::default()
        }
    }

    #[test]
    fn a_written_file_reads_back_the_same_and_leaves_nothing_beside_it() {
        let folder = std::env::temp_dir().join(format!("guidedog-results-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let path = folder.join("results.json");
        sample().write(&path).unwrap();
        assert_eq!(Results::read(&path).unwrap(), sample());
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
        fs::remove_dir_all(&folder).unwrap();
    }

    /// The names are read by programs we do not know: changing one must break this test.
    #[test]
    fn key_names_and_their_order_are_pinned() {
        let mut one = sample();
        one.cases.truncate(1);
        let expected = concat!(
            r#"{"suite":"paper17","ground":"","level":0,"randomize":false,"episodes":0,"seed":0,"locomotion":"","#,
            r#""supervisor":"","cases":[{"name":"-60/30","fx":0.0,"fy":0.0,"group":"trained","behavior":"spin","#,
            r#""episodes":10,"successes":10,"falls":1,"success_rate":1.0,"wilson_low":0.7224672001371107,"#,
            r#""wilson_high":1.0,"mean_vx":0.0,"mean_vy":0.0,"mean_wz":0.0,"heading_drift_deg_per_10s":0.0}],"#,
            r#""reward":{"total":0.61,"stop":0.22,"walk":0.13,"turn":0.08,"spin":0.16},"#,
            r#""oracle_reward":{"total":0.0,"stop":0.0,"walk":0.0,"turn":0.0,"spin":0.0}}"#,
        );
        assert_eq!(serde_json::to_string(&one).unwrap(), expected);
    }

    #[test]
    fn keys_of_a_later_version_are_skipped_and_missing_ones_named() {
        let mut value = serde_json::to_value(sample()).unwrap();
        value["a_later_key"] = serde_json::json!({"x": [1, 2]});
        value["cases"][0]["another"] = serde_json::json!("text");
        assert_eq!(serde_json::from_value::<Results>(value.clone()).unwrap(), sample());
        value.as_object_mut().unwrap().remove("seed");
        assert!(serde_json::from_value::<Results>(value).unwrap_err().to_string().contains("seed"));
    }

    #[test]
    fn a_value_json_cannot_say_is_refused_by_name() {
        let mut results = sample();
        results.cases[1].mean_wz = f64::NAN;
        let message = results.write(Path::new("never-written.json")).unwrap_err().to_string();
        assert_eq!(message, "case a: mean_wz is NaN, it must be finite");
    }

    #[test]
    fn groups_average_their_cases_and_the_worst_is_found() {
        assert_eq!(sample().group_success(Group::Trained), Some(0.75));
        assert_eq!(sample().group_success(Group::Outside), None);
        assert_eq!(sample().worst_case().unwrap().name, "a");
    }
}
