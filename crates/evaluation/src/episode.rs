//! An episode of a case: how long it is, when the pull sets in, and what the hand does.

use spatial::{Philox, Purpose};

use crate::{
    motion::DRIFT_WINDOW_S,
    recording::{STEP_S, steps},
    script::Noise,
    suite::Case,
};

/// Least and most time without force before the pull \[s\], each step between them as likely. Ours: a stride apart, so that
/// the pull meets every phase of the gait and every moment between two decisions. After a fixed time all episodes of a
/// nominal robot on level ground would be one.
pub const SETTLING_S: [f64; 2] = [2.0, 2.5];

/// The first sample under the pull in the episode of a robot.
pub fn onset(seed: u64, robot: usize) -> usize {
    let [first, end] = SETTLING_S.map(steps);
    first + Philox::new(seed, robot, 0, 0, Purpose::Onset).below((end - first) as u32) as usize
}

/// Samples of a case from the pull on: until all that is judged is over.
pub fn pulled_steps(case: &Case) -> usize {
    steps(case.script.settles_s() + DRIFT_WINDOW_S[1])
}

/// A case as one robot plays it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Episode<'a> {
    case: &'a Case,
    pub(crate) onset: usize,
    noise: Noise,
}

impl<'a> Episode<'a> {
    pub(crate) fn new(case: &'a Case, seed: u64, robot: usize) -> Self {
        Self { case, onset: onset(seed, robot), noise: Noise::new(seed, robot) }
    }

    /// Control steps of the episode.
    pub(crate) fn steps(&self) -> usize {
        self.onset + pulled_steps(self.case)
    }

    /// Force of the hand at a step: none at first, then what the case's script says \[N\], heading frame.
    pub(crate) fn force(&self, step: usize) -> [f32; 3] {
        match step.checked_sub(self.onset) {
            None => [0.0; 3],
            Some(pulled) => self.case.script.force(self.case.force, pulled as f64 * STEP_S, &self.noise),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pulls_set_in_at_every_step_of_half_a_second_and_last_as_long() {
        let mut counts = [0; 25];
        let case = Case::steady(-60.0, 0.0);
        for robot in 0..2500 {
            let episode = Episode::new(&case, 1, robot);
            counts[episode.onset - 100] += 1;
            assert_eq!(episode.steps() - episode.onset, 600);
            let before_and_under = [episode.onset - 1, episode.onset].map(|step| episode.force(step)[0]);
            assert_eq!(before_and_under, [0.0, -60.0]);
        }
        assert!(counts.iter().all(|count| (60..140).contains(count)), "{counts:?}");
    }
}
