//! Generalized advantage estimation (Schulman et al., *High-dimensional continuous control using generalized advantage
//! estimation*, ICLR 2016, equations 11–16).

/// One environment's rewards and values over a rollout.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Trajectory<'a> {
    /// Rewards, one a step.
    pub(crate) rewards: &'a [f32],
    /// Value of the state each step began in.
    pub(crate) values: &'a [f32],
    /// The step ended in a state whose value is zero.
    pub(crate) terminated: &'a [bool],
    /// The step was the last before a reset, but life goes on after it.
    pub(crate) truncated: &'a [bool],
    /// Value of the true last state of a truncated step; not read elsewhere.
    pub(crate) last_values: &'a [f32],
    /// Value of the state after the last step.
    pub(crate) next_value: f32,
}

/// Fills `advantages`, one a step.
pub(crate) fn generalized_advantage(
    trajectory: Trajectory<'_>,
    gamma: f32,
    lambda: f32,
    advantages: &mut [f32],
) {
    let t = trajectory;
    let mut next_value = t.next_value;
    let mut carried = 0.0;
    for step in (0..t.rewards.len()).rev() {
        let ended = t.terminated[step] || t.truncated[step];
        let after = match (t.terminated[step], t.truncated[step]) {
            (true, _) => 0.0,
            (false, true) => t.last_values[step],
            (false, false) => next_value,
        };
        let surprise = t.rewards[step] + gamma * after - t.values[step];
        carried = surprise + if ended { 0.0 } else { gamma * lambda * carried };
        advantages[step] = carried;
        next_value = t.values[step];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn advantages(terminated: [bool; 3], truncated: [bool; 3]) -> [f32; 3] {
        let mut out = [0.0; 3];
        let trajectory = Trajectory {
            rewards: &[1.0, 2.0, 3.0],
            values: &[0.5, 1.5, 2.5],
            terminated: &terminated,
            truncated: &truncated,
            last_values: &[10.0, 20.0, 30.0],
            next_value: 4.0,
        };
        generalized_advantage(trajectory, 0.5, 0.5, &mut out);
        out
    }

    #[test]
    fn by_hand() {
        // δ = 1 + .5·1.5 − .5, 2 + .5·2.5 − 1.5, 3 + .5·4 − 2.5; decay ¼.
        let (a, b, c) = (1.25, 1.75, 2.5);
        assert_eq!(advantages([false; 3], [false; 3]), [a + (b + c / 4.0) / 4.0, b + c / 4.0, c]);
    }

    #[test]
    fn death_has_no_future_and_a_time_out_has() {
        let death = advantages([false, true, false], [false; 3]);
        assert_eq!(death[1], 2.0 - 1.5);
        assert_eq!(death[0], 1.25 + death[1] / 4.0);
        let time_out = advantages([false; 3], [false, true, false]);
        assert_eq!(time_out[1], 2.0 + 0.5 * 20.0 - 1.5);
        // Neither looks past the reset.
        assert_eq!(death[2], time_out[2]);
    }
}
