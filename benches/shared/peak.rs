//! The most a core can do: fused multiply-adds on registers.

use std::{hint::black_box, time::Instant};

use spatial::{Lane, f32x16};

/// Independent sums: more than latency times ports of any processor we know, fewer than its registers (a sum takes two
/// of AVX2's sixteen).
const SUMS: usize = if cfg!(target_feature = "avx512f") { 16 } else { 6 };
const ROUNDS: usize = 1 << 21;

/// Operations a second of one thread, two for each multiply-add, the best of five tries.
pub(crate) fn fused_multiply_adds() -> f64 {
    let once = || {
        let factor = black_box(<f32x16 as Lane>::splat(0.999));
        let addend = black_box(<f32x16 as Lane>::splat(0.001));
        let mut sums = [f32x16::ONE; SUMS];
        let start = Instant::now();
        for _ in 0..ROUNDS {
            for sum in &mut sums {
                *sum = Lane::mul_add(*sum, factor, addend);
            }
        }
        let elapsed = start.elapsed().as_secs_f64();
        black_box(sums);
        (2 * SUMS * ROUNDS * <f32x16 as Lane>::WIDTH) as f64 / elapsed
    };
    (0..5).map(|_| once()).fold(0.0, f64::max)
}
