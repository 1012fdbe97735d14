//! Sixteen numbers in single precision, side by side.

use wide::{f32x8, f32x16};

use super::{Lane, Mask};

impl Mask<f32x16> for f32x16 {
    #[inline(always)]
    fn select(self, if_true: f32x16, if_false: f32x16) -> f32x16 {
        self.bitselect(if_true, if_false)
    }
    #[inline(always)]
    fn and(self, other: Self) -> Self {
        self & other
    }
    #[inline(always)]
    fn or(self, other: Self) -> Self {
        self | other
    }
    #[inline(always)]
    fn any(self) -> bool {
        f32x16::any(self)
    }
    #[inline(always)]
    fn bits(self) -> u32 {
        self.to_bitmask()
    }
}

impl Lane for f32x16 {
    const WIDTH: usize = 16;
    type Mask = f32x16;
    type Scalar = f32;
    type Indices = [u32; 16];

    #[inline(always)]
    fn scalar(x: f64) -> f32 {
        x as f32
    }
    #[inline(always)]
    fn broadcast(x: f32) -> Self {
        f32x16::splat(x)
    }
    #[inline(always)]
    fn floor(self) -> Self {
        f32x16::floor(self)
    }
    #[inline(always)]
    fn indices(self, count: usize) -> [u32; 16] {
        let last = count as u32 - 1;
        self.fast_max(Self::ZERO).fast_trunc_int().to_array().map(|index| (index as u32).min(last))
    }
    #[inline(always)]
    fn gather(table: &[[f32; 16]], rows: &[u32; 16]) -> [Self; 16] {
        // Four transposed squares of eight by eight. Loops, as closures would not be inlined.
        let mut gathered = [Self::ZERO; 16];
        for start in [0, 8] {
            let mut squares = [[f32x8::ZERO; 8]; 2];
            for (lane, &row) in rows.iter().enumerate() {
                let half = table[row as usize][start..].first_chunk().expect("half a row");
                squares[lane / 8][lane % 8] = f32x8::new(*half);
            }
            let [first, second] = squares.map(f32x8::transpose);
            for k in 0..8 {
                let both = gathered[start + k].as_mut_array();
                both[..8].copy_from_slice(first[k].as_array());
                both[8..].copy_from_slice(second[k].as_array());
            }
        }
        gathered
    }

    #[inline(always)]
    fn splat(x: f64) -> Self {
        f32x16::splat(x as f32)
    }
    #[inline(always)]
    fn get(&self, lane: usize) -> f64 {
        f64::from(self.as_array()[lane])
    }
    #[inline(always)]
    fn set(&mut self, lane: usize, x: f64) {
        self.as_mut_array()[lane] = x as f32;
    }
    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        f32x16::mul_add(self, a, b)
    }
    #[inline(always)]
    fn neg_mul_add(self, a: Self, b: Self) -> Self {
        f32x16::mul_neg_add(self, a, b)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f32x16::sqrt(self)
    }
    #[cfg(all(target_arch = "x86_64", target_feature = "avx512f"))]
    #[inline(always)]
    fn inverse_sqrt(self) -> Self {
        // Half the latency of a root and a division: 14 bits, doubled by a step of Newton's.
        let guess = inverse_sqrt_14_bits(self);
        let half = self * f32x16::splat(0.5);
        guess * (half * guess).mul_neg_add(guess, f32x16::splat(1.5))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.fast_min(other)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.fast_max(other)
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        f32x16::sin_cos(self)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> f32x16 {
        self.simd_lt(other)
    }
    #[inline(always)]
    fn le(self, other: Self) -> f32x16 {
        self.simd_le(other)
    }
    #[inline(always)]
    fn gt(self, other: Self) -> f32x16 {
        self.simd_gt(other)
    }
    #[inline(always)]
    fn ge(self, other: Self) -> f32x16 {
        self.simd_ge(other)
    }
}

#[cfg(all(target_arch = "x86_64", target_feature = "avx512f"))]
#[inline(always)]
fn inverse_sqrt_14_bits(x: f32x16) -> f32x16 {
    use std::arch::x86_64::{_mm512_loadu_ps, _mm512_rsqrt14_ps, _mm512_storeu_ps};
    let mut out = f32x16::ZERO;
    // SAFETY: the instructions exist where this is compiled, and both arrays are of sixteen numbers. `wide` has no such function.
    #[allow(unsafe_code)]
    unsafe {
        let guess = _mm512_rsqrt14_ps(_mm512_loadu_ps(x.as_array().as_ptr()));
        _mm512_storeu_ps(out.as_mut_array().as_mut_ptr(), guess);
    }
    out
}
