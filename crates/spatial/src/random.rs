//! Counter-based random numbers.
//!
//! Philox4x32-10 (Salmon et al., *Parallel random numbers: as easy as 1, 2, 3*, SC 2011): a keyed bijection
//! of a 128-bit counter. A number is a pure function of (seed, environment, episode, step, purpose, index), so
//! results depend neither on the number of threads nor on the order of calls, and nothing needs saving.

/// What a random stream is used for; two purposes never share numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Purpose {
    /// Constants of an environment drawn once: mass, friction, bar.
    Environment = 1,
    /// State at the beginning of an episode.
    Reset = 2,
    /// Velocity commands and scripted handler forces.
    Command = 3,
    /// Disturbance forces.
    Disturbance = 4,
    /// Observation noise.
    Observation = 5,
    /// Exploration noise of the policy.
    Action = 6,
    /// Network weights at the start.
    Weights = 7,
    /// Order of samples in an update.
    Shuffle = 8,
    /// Shape of the terrain.
    Terrain = 9,
    /// Anything a test or an evaluation draws for itself.
    Evaluation = 10,
    /// Observation noise of the supervisor.
    SupervisorObservation = 11,
    /// Error of the force that supervisors see in an evaluation.
    ForceObservation = 12,
    /// When an environment acts without exploration noise.
    Quiet = 13,
    /// When the pull of an evaluation's episode sets in.
    Onset = 14,
}

/// A stream of random numbers; `Copy`, so a stream can be replayed.
#[derive(Clone, Copy, Debug)]
pub struct Philox {
    key: [u32; 2],
    counter: [u32; 4],
    buffer: [u32; 4],
    used: u8,
}

impl Philox {
    /// The stream of one purpose at one moment of one environment.
    ///
    /// `episode` and `step` are 32 bit, `environment` is 24 bit; 2³² blocks of four numbers follow.
    pub fn new(seed: u64, environment: usize, episode: u32, step: u32, purpose: Purpose) -> Self {
        debug_assert!(environment < 1 << 24);
        let stream = (environment as u32) << 8 | purpose as u32;
        Self {
            key: [seed as u32, (seed >> 32) as u32],
            counter: [0, step, episode, stream],
            buffer: [0; 4],
            used: 4,
        }
    }

    /// The next 32 random bits.
    #[inline]
    pub fn next_u32(&mut self) -> u32 {
        if self.used == 4 {
            self.buffer = philox4x32_10(self.counter, self.key);
            self.counter[0] = self.counter[0].wrapping_add(1);
            self.used = 0;
        }
        let value = self.buffer[self.used as usize];
        self.used += 1;
        value
    }

    /// Uniform in `[0, 1)` with 24 bits, exact in `f32`.
    #[inline]
    pub fn uniform01(&mut self) -> f32 {
        (self.next_u32() >> 8) as f32 * (1.0 / 16_777_216.0)
    }

    /// Uniform from `low` to `high`, which itself may come of rounding.
    #[inline]
    pub fn uniform(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.uniform01()
    }

    /// Standard normal (Box–Muller, one of the pair).
    #[inline]
    pub fn normal(&mut self) -> f32 {
        let radius = (-2.0 * (1.0 - self.uniform01()).ln()).sqrt();
        radius * (std::f32::consts::TAU * self.uniform01()).cos()
    }

    /// Uniform integer in `0..bound` (Lemire's multiply-shift; bias below 2⁻³² · bound).
    #[inline]
    pub fn below(&mut self, bound: u32) -> u32 {
        ((u64::from(self.next_u32()) * u64::from(bound)) >> 32) as u32
    }
}

fn philox4x32_10(mut counter: [u32; 4], mut key: [u32; 2]) -> [u32; 4] {
    for _ in 0..10 {
        let a = u64::from(counter[0]) * 0xD251_1F53;
        let b = u64::from(counter[2]) * 0xCD9E_8D57;
        counter = [
            (b >> 32) as u32 ^ counter[1] ^ key[0],
            b as u32,
            (a >> 32) as u32 ^ counter[3] ^ key[1],
            a as u32,
        ];
        key = [key[0].wrapping_add(0x9E37_79B9), key[1].wrapping_add(0xBB67_AE85)];
    }
    counter
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Known answers published with the reference implementation (Random123, `kat_vectors`).
    #[test]
    fn philox_gives_the_published_vectors() {
        assert_eq!(philox4x32_10([0; 4], [0; 2]), [0x6627_e8d5, 0xe169_c58d, 0xbc57_ac4c, 0x9b00_dbd8]);
        assert_eq!(
            philox4x32_10([u32::MAX; 4], [u32::MAX; 2]),
            [0x408f_276d, 0x41c8_3b0e, 0xa20b_c7c6, 0x6d54_51fd]
        );
        assert_eq!(
            philox4x32_10([0x243f_6a88, 0x85a3_08d3, 0x1319_8a2e, 0x0370_7344], [0xa409_3822, 0x299f_31d0]),
            [0xd16c_fe09, 0x94fd_cceb, 0x5001_e420, 0x2412_6ea1]
        );
    }

    #[test]
    fn moments_are_those_of_the_distributions() {
        let mut random = Philox::new(7, 3, 0, 0, Purpose::Evaluation);
        let n = 200_000;
        let (mut sum, mut square, mut uniform) = (0.0_f64, 0.0_f64, 0.0_f64);
        for _ in 0..n {
            let x = f64::from(random.normal());
            sum += x;
            square += x * x;
            uniform += f64::from(random.uniform01());
        }
        let n = f64::from(n);
        assert!((sum / n).abs() < 4.0 / n.sqrt());
        assert!((square / n - 1.0).abs() < 4.0 * (2.0 / n).sqrt());
        assert!((uniform / n - 0.5).abs() < 4.0 * (1.0 / 12.0 / n).sqrt());
    }

    #[test]
    fn streams_of_different_purposes_differ() {
        let draw = |purpose| Philox::new(1, 0, 0, 0, purpose).next_u32();
        assert_ne!(draw(Purpose::Reset), draw(Purpose::Command));
    }
}
