//! Settings of the guidance task.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::PullConfig;
use crate::{
    bounds::within,
    locomotion::Terrain,
    simulation::{CONTROL_PERIOD_S, Randomization, ResetSpread, is_whole_steps},
};

/// Lowest velocity command v_x, v_y \[m/s\], ω_z \[rad/s\]. Source: ours.
pub const COMMAND_LOW: [f32; 3] = [-0.3, -0.4, -1.5];
/// Highest velocity command. Source: ours.
pub const COMMAND_HIGH: [f32; 3] = [1.2, 0.4, 1.5];

/// A command within its limits; what is no number becomes the lower limit.
pub(super) fn limited(command: &[f32]) -> [f32; 3] {
    std::array::from_fn(|i| command[i].max(COMMAND_LOW[i]).min(COMMAND_HIGH[i]))
}

/// Settings of the guidance task. Defaults are the paper's but where a field names another source.
#[derive(Clone, Debug, PartialEq, JsonSchema, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GuidanceConfig {
    /// The locomotion policy, an ONNX file; "shipped" is the one inside the program. Source: docs/results.md.
    pub locomotion: String,
    /// The ground. Source: the paper, "rough".
    pub terrain: Terrain,
    /// Highest level robots begin on; levels are drawn uniformly \[levels; 0 to 9\]. Source: the paper, 5.
    pub max_level: usize,
    /// Length of an episode \[s; 1 to 1000\]. Source: the paper, 20.
    pub episode_s: f32,
    /// Time between two decisions of the supervisor, a multiple of 0.02 \[s; 0.02 to 1\]. Source: ours, 0.1.
    pub supervisor_period_s: f32,
    /// Scale of the sensors' errors, of both networks \[1; 0 to 10\]. Source: Isaac Lab, whose errors are 1.
    pub observation_noise: f32,
    /// Force that counts as 1 to the learning network; the smaller, the steeper the steps of Table II that it learns \[N; 0.1 to
    /// 1000\]. Source: docs/findings.md, "The unit of force".
    pub force_unit_n: f32,
    /// The handler's pulls.
    pub pull: PullConfig,
    /// How far beyond a threshold of Table II a pull must be to mean more, along x and along y: one that is on it is gentle then
    /// with something to spare \[N; 0 to 10\]. Source: docs/findings.md, "Thresholds"; the paper: 0.
    pub threshold_margin_n: [f32; 2],
    /// Weight of the squared change of the command \[s/m² and s/rad²; -10 to 0\]. Source: docs/findings.md, "A price on changes of
    /// the command"; the paper: −1e-4.
    pub command_rate: f32,
    /// Weight of the drift of the heading: the yaw rate's running mean over 0.5 s, less what is wanted, at most 0.15 rad/s
    /// \[1/rad; -100 to 0\]. Source: docs/findings.md, "Drift of the heading"; the paper: 0.
    pub heading_drift: f32,
    /// Weight of the drift of the place where a robot is to stay, in Stop and Spin: the size of the running mean over 0.5 s of the
    /// horizontal velocity, less what is wanted, at most 0.15 m/s \[1/m; -100 to 0\]. Source: docs/findings.md, "Drift of the place"; the paper: 0.
    pub place_drift: f32,
    /// Paid once for a fall \[1; -100 to 0\]. Source: docs/findings.md, "A price on falls"; the paper: 0.
    pub fall: f32,
    /// Differences between robots.
    pub randomization: Randomization,
    /// First states of episodes.
    pub reset: ResetSpread,
}

impl Default for GuidanceConfig {
    fn default() -> Self {
        Self {
            locomotion: "shipped".into(),
            terrain: Terrain::Rough,
            max_level: 5,
            episode_s: 20.0,
            supervisor_period_s: 0.1,
            observation_noise: 1.0,
            force_unit_n: 1.0,
            pull: PullConfig::default(),
            threshold_margin_n: [1.1, 0.8],
            command_rate: -0.01,
            heading_drift: -2.0,
            place_drift: -2.0,
            fall: -3.0,
            randomization: Randomization::default(),
            reset: ResetSpread::default(),
        }
    }
}

impl GuidanceConfig {
    /// Whether handlers pull as the paper's, and mean what its Table II says.
    pub(super) fn asks_as_the_paper(&self) -> bool {
        self.pull == PullConfig::paper() && self.threshold_margin_n == [0.0; 2]
    }

    /// Checks every value.
    ///
    /// # Errors
    /// Names the first one out of range, with what is allowed.
    pub fn validate(&self) -> Result<(), String> {
        within("max_level", self.max_level as f32, 0.0, 9.0)?;
        within("episode_s", self.episode_s, 1.0, 1000.0)?;
        within("supervisor_period_s", self.supervisor_period_s, 0.02, 1.0)?;
        if !is_whole_steps(self.supervisor_period_s) {
            return Err(format!(
                "supervisor_period_s is {}, must be a multiple of {CONTROL_PERIOD_S}",
                self.supervisor_period_s
            ));
        }
        within("observation_noise", self.observation_noise, 0.0, 10.0)?;
        within("force_unit_n", self.force_unit_n, 0.1, 1000.0)?;
        for margin in self.threshold_margin_n {
            within("threshold_margin_n", margin, 0.0, 10.0)?;
        }
        within("command_rate", self.command_rate, -10.0, 0.0)?;
        within("heading_drift", self.heading_drift, -100.0, 0.0)?;
        within("place_drift", self.place_drift, -100.0, 0.0)?;
        within("fall", self.fall, -100.0, 0.0)?;
        self.pull.validate()?;
        self.randomization.validate()?;
        self.reset.validate()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulation::control_steps;

    #[test]
    fn a_value_out_of_range_is_named() {
        GuidanceConfig::default().validate().unwrap();
        let refusal = |config: GuidanceConfig| config.validate().unwrap_err();
        let config = GuidanceConfig { supervisor_period_s: 0.05, ..GuidanceConfig::default() };
        assert!(refusal(config).contains("supervisor_period_s is 0.05, must be a multiple of 0.02"));
        let config = GuidanceConfig { max_level: 10, ..GuidanceConfig::default() };
        assert!(refusal(config).contains("max_level is 10"));
        let config = GuidanceConfig { threshold_margin_n: [1.0, -1.5], ..GuidanceConfig::default() };
        assert!(refusal(config).contains("threshold_margin_n is -1.5"));
    }

    #[test]
    fn who_pulls_or_reads_otherwise_does_not_ask_as_the_paper() {
        let asks = |pull, threshold_margin_n| {
            GuidanceConfig { pull, threshold_margin_n, ..GuidanceConfig::default() }.asks_as_the_paper()
        };
        assert!(asks(PullConfig::paper(), [0.0; 2]));
        assert!(!asks(PullConfig::paper(), [0.0, 0.5]) && !asks(PullConfig::default(), [0.0; 2]));
    }

    #[test]
    fn periods_in_control_steps() {
        assert_eq!([0.02, 0.1, 0.2, 5.0].map(control_steps), [1, 5, 10, 250]);
    }
}
