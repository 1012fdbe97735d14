//! `results.json`: what an evaluation found, for programs and for the report.
//!
//! The key names are a contract with every reader outside this repository: fields are added, never renamed. Keys this
//! version does not know are skipped on read, so an old program reads a newer file.

mod case;
mod missed;

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use policy::write_atomic;
use serde::{Deserialize, Serialize};
pub use tasks::guidance::Behavior;
use tasks::guidance::{PAPER_TOTAL, PULL_THRESHOLD_X_N, PULL_THRESHOLD_Y_N};

pub use case::{CaseResult, Group};
pub use missed::{MissedRow, MissedTable};

use crate::{
    measures::{reading::Confusion, threshold::Threshold},
    statistics::{Interval, mean, wilson_interval},
};

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

/// Version of what is measured and how. It grows with every change of a suite, a criterion, a measure or the physics that moves
/// numbers: results of different versions must not stand side by side.
pub const VERSION: u32 = 3;

/// All that one run of `guidedog evaluate` found.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Results {
    /// Name of the suite: "paper17", "mirror17", ...
    pub suite: String,
    /// The [`VERSION`] that found it; 0 in files from before there was one.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub version: u32,
    /// Checksum of both policies, eight hexadecimal digits; empty where it is not known.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub policies: String,
    /// Kind of ground: "flat", "rough", "stairs".
    pub ground: String,
    /// Terrain level of every tile, 0 for flat ground.
    pub level: usize,
    /// Whether robot, friction and harness were drawn anew for each episode.
    pub randomize: bool,
    /// Coulomb friction of every contact, if not that of the robots \[1\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction: Option<f64>,
    /// Error of the force that the supervisor saw, ± \[N\].
    #[serde(default, skip_serializing_if = "is_zero")]
    pub force_noise_n: f64,
    /// Scale of the errors of all other sensors; 1 is that of training \[1\].
    #[serde(default, skip_serializing_if = "is_zero")]
    pub sensor_noise: f64,
    /// Whether the pulls were seen without acting on the robot.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub unloaded: bool,
    /// Episodes for each case.
    pub episodes: usize,
    /// Seed of all random draws.
    pub seed: u64,
    /// The locomotion policy judged: "shipped" or a file.
    pub locomotion: String,
    /// The supervisor judged: "shipped", a file, "oracle", "rules", "rules-margin" or "dominance"; "learned" if `reproduce` trained it.
    pub supervisor: String,
    /// One entry for each case, in the suite's order.
    pub cases: Vec<CaseResult>,
    /// Behavior reward of the judged supervisor, without exploration noise.
    pub reward: BehaviorReward,
    /// Behavior reward of the oracle over the same forces and seeds.
    pub oracle_reward: BehaviorReward,
    /// What Table II makes of the forces, against what the motions looked like, over all cases.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub confusion: Option<Confusion>,
    /// Falls in a thousand episodes, over all cases.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub falls_per_1000: Option<f64>,
    /// What only the suite `plane` has.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plane: Option<PlaneResult>,
    /// Who simulated, if not guidedog itself: "MuJoCo 4.0.0".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub engine: Option<String>,
}

fn is_zero<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

/// What the suite `plane` says of the whole plane of forces.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PlaneResult {
    /// Share of the episodes more than 4 N from every threshold whose motion looked like what Table II says.
    pub read_right_beyond_4n: f64,
    /// Lower end of its 95 % Wilson interval.
    pub read_right_low: f64,
    /// Upper end of its 95 % Wilson interval.
    pub read_right_high: f64,
    /// Success rate of pulls to the left less that of pulls to the right.
    pub left_right_asymmetry: f64,
    /// Line scans across the thresholds.
    pub thresholds: Vec<Threshold>,
}

impl PlaneResult {
    /// From the points of the plane and the scans.
    pub fn new(cases: &[CaseResult], thresholds: Vec<Threshold>) -> Self {
        let beyond = cases.iter().filter(|case| is_beyond_4n(case));
        let counts = beyond.filter_map(|case| Some((case.read_as?.of(case.behavior), case.episodes)));
        let (right, episodes) = counts.fold((0, 0), |sum, one| (sum.0 + one.0, sum.1 + one.1));
        let Interval { low, high } = wilson_interval(right, episodes);
        let side = |sign: f64| {
            let rates = cases.iter().filter(|case| case.fy * sign > 0.0).map(|case| case.success_rate);
            mean(&rates.collect::<Vec<_>>()).unwrap_or(0.0)
        };
        Self {
            read_right_beyond_4n: right as f64 / episodes.max(1) as f64,
            read_right_low: low,
            read_right_high: high,
            left_right_asymmetry: side(1.0) - side(-1.0),
            thresholds,
        }
    }
}

/// Whether a force is more than 4 N from where Table II would read it otherwise.
fn is_beyond_4n(case: &CaseResult) -> bool {
    let x = f64::from(-PULL_THRESHOLD_X_N) - case.fx;
    let y = f64::from(PULL_THRESHOLD_Y_N) - case.fy.abs();
    x.abs() > 4.0 && y.abs() > 4.0
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
    /// Fills what sums up the cases.
    pub fn with_sums(mut self) -> Self {
        let mut confusion = Confusion::default();
        for case in &self.cases {
            confusion.add(case.behavior, &case.read_as.unwrap_or_default());
        }
        let falls: usize = self.cases.iter().map(|case| case.falls).sum();
        let episodes: usize = self.cases.iter().map(|case| case.episodes).sum();
        self.confusion = Some(confusion);
        self.falls_per_1000 = Some(1000.0 * falls as f64 / episodes.max(1) as f64);
        self
    }

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
    use crate::measures::reading::Readings;

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
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("results.json");
        sample().write(&path).unwrap();
        assert_eq!(Results::read(&path).unwrap(), sample());
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
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
    fn the_plane_counts_what_lies_beyond_4_newtons_of_every_threshold() {
        let case = |fx: f64, fy: f64, right: usize, successes: usize| {
            let behavior = Behavior::of_force([fx as f32, fy as f32, 0.0]);
            let mut readings = Readings::default();
            (0..right).for_each(|_| readings.count(behavior));
            CaseResult {
                fx,
                fy,
                behavior,
                read_as: Some(readings),
                ..CaseResult::from_counts(10, successes, 0)
            }
        };
        let cases = [
            case(0.0, 0.0, 9, 9),
            case(-60.0, 50.0, 10, 8),
            case(-60.0, -50.0, 8, 3),
            case(-43.0, 0.0, 0, 0),
        ];
        let plane = PlaneResult::new(&cases, Vec::new());
        assert!((plane.read_right_beyond_4n - 0.9).abs() < 1e-12, "27 of 30");
        assert!((plane.left_right_asymmetry - 0.5).abs() < 1e-12);
        let sums = Results { cases: cases.to_vec(), ..Results::default() }.with_sums();
        assert_eq!(sums.confusion.unwrap().spin.spin, 18);
        assert_eq!(sums.falls_per_1000, Some(0.0));
    }

    #[test]
    fn groups_average_their_cases_and_the_worst_is_found() {
        assert_eq!(sample().group_success(Group::Trained), Some(0.75));
        assert_eq!(sample().group_success(Group::Outside), None);
        assert_eq!(sample().worst_case().unwrap().name, "a");
    }
}
