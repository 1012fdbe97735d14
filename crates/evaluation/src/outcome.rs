//! From recordings to results: what one episode showed, and what a case's episodes showed together.

use tasks::guidance::{Behavior, behavior_reward};

use crate::{
    criteria::{Criterion, missed, misses},
    measures::{
        chatter::switches_per_10s,
        comfort::{Comfort, comfort},
        latency::{Latency, latency},
        reading::{Readings, nearest},
        split::{Met, splits},
        stopping::{Stopping, stopping},
    },
    motion::{DRIFT_WINDOW_S, Motion, WINDOW_S, range},
    recording::{Recording, Sample, mean_velocity, steps},
    results::CaseResult,
    statistics::{mean, median},
    suite::Case,
};

/// What one episode showed.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// What it lacked of its behavior; nothing, if it obeyed.
    missed: Vec<Criterion>,
    motion: Motion,
    /// Mean behavior reward, 0 after a fall.
    reward: f64,
    /// What it looked like.
    reading: Behavior,
    latency: Option<Latency>,
    stopping: Option<Stopping>,
    switches: f64,
    comfort: Comfort,
    met: Met,
}

impl Outcome {
    /// Measures an episode with [`crate::episode::pulled_steps`] samples under the pull, and keeps what it met.
    pub fn of(case: &Case, recording: &Recording, met: Met) -> Self {
        let pulled = recording.pulled();
        let change = recording.onset + steps(case.script.settles_s());
        let settled = &recording.samples[change..];
        let (behavior, target) = (case.behavior(), case.target());
        let motion = Motion::of(settled, target[2]);
        let side = f64::from(case.force[1]);
        let before = case.script.before();
        let halts = |before: &[f32; 3]| behavior.stays() && !Behavior::of_force(*before).stays();
        Self {
            missed: if recording.fell() {
                vec![Criterion::Upright]
            } else {
                missed(&motion, behavior, target)
            },
            motion,
            reward: recording.upright().iter().map(|s| reward_of(s).1).sum::<f64>() / pulled.len() as f64,
            reading: nearest(mean_velocity(&settled[range(WINDOW_S)]), side),
            latency: before.and_then(|before| latency(&recording.samples, change, before, case.force)),
            stopping: before.filter(halts).and_then(|_| stopping(settled)),
            switches: switches_per_10s(&settled[range(DRIFT_WINDOW_S)], side),
            // With a second before the pull, so that braking is seen from its beginning.
            comfort: comfort(&recording.samples[recording.onset.saturating_sub(steps(1.0))..]),
            met,
        }
    }

    fn fell(&self) -> bool {
        self.missed.contains(&Criterion::Upright)
    }

    fn obeyed(&self) -> bool {
        self.missed.is_empty()
    }
}

/// What the force of a step means, and the behavior reward of its velocity.
pub fn reward_of(sample: &Sample) -> (Behavior, f64) {
    let behavior = Behavior::of_force(sample.force);
    (behavior, f64::from(behavior_reward(behavior.target(sample.force), sample.velocity)))
}

/// What the episodes of a case showed together.
pub fn summarize(case: &Case, episodes: &[Outcome]) -> CaseResult {
    let falls = episodes.iter().filter(|episode| episode.fell()).count();
    let obeyed = episodes.iter().filter(|episode| episode.obeyed()).count();
    let count = episodes.len().max(1) as f64;
    let mean_motion =
        |of: &dyn Fn(&Motion) -> f64| episodes.iter().map(|e| of(&e.motion)).sum::<f64>() / count;
    // Measures of robots that stayed on their feet.
    let upright: Vec<&Outcome> = episodes.iter().filter(|episode| !episode.fell()).collect();
    let mean_of = |of: &dyn Fn(&Outcome) -> f64| mean(&upright.iter().map(|e| of(e)).collect::<Vec<_>>());
    let median_of = |of: &dyn Fn(&Outcome) -> Option<f64>| {
        // What did not happen took forever.
        let times: Vec<f64> = upright.iter().map(|e| of(e).unwrap_or(f64::INFINITY)).collect();
        median(&times).filter(|time| time.is_finite())
    };
    let latency_of = |of: fn(&Latency) -> Option<f64>| median_of(&|e| e.latency.as_ref().and_then(of));
    let mut read_as = Readings::default();
    upright.iter().for_each(|episode| read_as.count(episode.reading));
    CaseResult {
        name: case.name.clone(),
        fx: f64::from(case.force[0]),
        fy: f64::from(case.force[1]),
        group: case.group,
        behavior: case.behavior(),
        mean_vx: mean_motion(&|m| m.velocity[0]),
        mean_vy: mean_motion(&|m| m.velocity[1]),
        mean_wz: mean_motion(&|m| m.velocity[2]),
        heading_drift_deg_per_10s: mean_motion(&|m| m.heading_drift.abs().to_degrees()),
        mean_planar_speed: Some(mean_motion(&|m| m.planar_speed)),
        position_drift_m: Some(mean_motion(&|m| m.excursion)),
        reward: Some(episodes.iter().map(|episode| episode.reward).sum::<f64>() / count),
        read_as: Some(read_as),
        misses: misses(episodes.iter().map(|episode| episode.missed.as_slice())),
        splits: splits(episodes.iter().map(|episode| (episode.met, episode.missed.as_slice()))),
        command_latency_50_s: latency_of(|l| l.command_50_s),
        command_latency_90_s: latency_of(|l| l.command_90_s),
        velocity_latency_90_s: latency_of(|l| l.velocity_90_s),
        stopping_time_s: median_of(&|e| e.stopping.map(|s| s.time_s)),
        stopping_distance_m: median_of(&|e| e.stopping.map(|s| s.distance_m)),
        switches_per_10s: mean_of(&|e| e.switches),
        hand_force_peak_n: mean_of(&|e| e.comfort.force_peak_n),
        hand_force_rate_nps: mean_of(&|e| e.comfort.force_rate_nps),
        hand_acceleration_mps2: mean_of(&|e| e.comfort.acceleration_mps2),
        hand_jerk_mps3: mean_of(&|e| e.comfort.jerk_mps3),
        ..CaseResult::from_counts(episodes.len(), obeyed, falls)
    }
}
