//! The number a kernel computes with: one `f64`, or sixteen `f32` side by side.
//!
//! A kernel written over [`Lane`] has no branch a single lane could take alone: choices go through
//! [`Mask::select`]. Instantiated for `f64` it is its own reference.

use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

use wide::f32x8;
pub use wide::f32x16;

/// One truth value a lane.
pub trait Mask<L>: Copy {
    /// `if_true` where the mask is set, `if_false` elsewhere.
    fn select(self, if_true: L, if_false: L) -> L;
    /// Lanewise and.
    fn and(self, other: Self) -> Self;
    /// Lanewise or.
    fn or(self, other: Self) -> Self;
    /// Whether any lane is set.
    fn any(self) -> bool;
    /// One bit a lane, the first the lowest.
    fn bits(self) -> u32;
}

/// A bundle of [`Lane::WIDTH`] real numbers with lanewise arithmetic.
pub trait Lane:
    Copy
    + Send
    + Sync
    + 'static
    + PartialEq
    + std::fmt::Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
{
    /// How many environments one value carries.
    const WIDTH: usize;
    /// The result of a comparison.
    type Mask: Mask<Self>;
    /// One number at the lane's precision: how constants are stored.
    type Scalar: Copy + Send + Sync + std::fmt::Debug + PartialEq;
    /// An index a lane.
    type Indices: AsRef<[u32]>;

    /// A constant at the lane's precision.
    fn scalar(x: f64) -> Self::Scalar;
    /// The same constant in every lane.
    fn broadcast(x: Self::Scalar) -> Self;
    /// Largest whole number not above the value.
    fn floor(self) -> Self;
    /// Every lane as an index into `count` things: cut off to whole numbers and moved to the nearest of 0 to `count` − 1, NaN
    /// to one of them. `count` is at most 2²⁴, from which on not every whole number has a place in single precision.
    fn indices(self, count: usize) -> Self::Indices;
    /// From every lane's row of a table, lane by lane: the k-th result has the k-th numbers.
    fn gather(table: &[[f32; 16]], rows: &Self::Indices) -> [Self; 16];

    /// The same number in every lane, rounded to the lane's precision.
    fn splat(x: f64) -> Self;
    /// The value of one lane.
    fn get(&self, lane: usize) -> f64;
    /// Replaces the value of one lane.
    fn set(&mut self, lane: usize, x: f64);
    /// `self * a + b` with one rounding.
    fn mul_add(self, a: Self, b: Self) -> Self;
    /// `b - self * a` with one rounding.
    fn neg_mul_add(self, a: Self, b: Self) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// One over the square root of a positive number, not always to the last bit.
    #[inline(always)]
    fn inverse_sqrt(self) -> Self {
        Self::one() / self.sqrt()
    }
    /// Absolute value.
    fn abs(self) -> Self;
    /// Lesser of two; which one is returned for NaN is not specified.
    fn min(self, other: Self) -> Self;
    /// Greater of two; which one is returned for NaN is not specified.
    fn max(self, other: Self) -> Self;
    /// Sine and cosine \[rad\].
    fn sin_cos(self) -> (Self, Self);
    /// `self < other`.
    fn lt(self, other: Self) -> Self::Mask;
    /// `self <= other`.
    fn le(self, other: Self) -> Self::Mask;
    /// `self > other`.
    fn gt(self, other: Self) -> Self::Mask;
    /// `self >= other`.
    fn ge(self, other: Self) -> Self::Mask;

    /// Zero in every lane.
    #[inline(always)]
    fn zero() -> Self {
        Self::splat(0.0)
    }
    /// One in every lane.
    #[inline(always)]
    fn one() -> Self {
        Self::splat(1.0)
    }
    /// Lanewise limit to `[low, high]`.
    #[inline(always)]
    fn clamp(self, low: Self, high: Self) -> Self {
        self.max(low).min(high)
    }
    /// Builds a value lane by lane.
    #[inline(always)]
    fn from_fn(mut value: impl FnMut(usize) -> f64) -> Self {
        let mut out = Self::zero();
        for lane in 0..Self::WIDTH {
            out.set(lane, value(lane));
        }
        out
    }
}

impl Mask<f64> for bool {
    #[inline(always)]
    fn select(self, if_true: f64, if_false: f64) -> f64 {
        if self { if_true } else { if_false }
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
        self
    }
    #[inline(always)]
    fn bits(self) -> u32 {
        u32::from(self)
    }
}

impl Lane for f64 {
    const WIDTH: usize = 1;
    type Mask = bool;
    type Scalar = f64;
    type Indices = [u32; 1];

    #[inline(always)]
    fn scalar(x: f64) -> f64 {
        x
    }
    #[inline(always)]
    fn broadcast(x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn floor(self) -> Self {
        f64::floor(self)
    }
    #[inline(always)]
    fn indices(self, count: usize) -> [u32; 1] {
        // A float becomes the nearest number of the type.
        [(self as u32).min(count as u32 - 1)]
    }
    #[inline(always)]
    fn gather(table: &[[f32; 16]], &[row]: &[u32; 1]) -> [Self; 16] {
        table[row as usize].map(f64::from)
    }

    #[inline(always)]
    fn splat(x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn get(&self, _lane: usize) -> f64 {
        *self
    }
    #[inline(always)]
    fn set(&mut self, _lane: usize, x: f64) {
        *self = x;
    }
    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        f64::mul_add(self, a, b)
    }
    #[inline(always)]
    fn neg_mul_add(self, a: Self, b: Self) -> Self {
        f64::mul_add(-self, a, b)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        f64::min(self, other)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        f64::max(self, other)
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        f64::sin_cos(self)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self < other
    }
    #[inline(always)]
    fn le(self, other: Self) -> bool {
        self <= other
    }
    #[inline(always)]
    fn gt(self, other: Self) -> bool {
        self > other
    }
    #[inline(always)]
    fn ge(self, other: Self) -> bool {
        self >= other
    }
}

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
    fn abs(self) -> Self {
        f32x16::abs(self)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lanes_agree_with_scalars() {
        for step in 0..200 {
            let value = |lane: usize| (step * 16 + lane) as f64 * 0.013 - 20.0;
            let (s, c) = f32x16::from_fn(value).sin_cos();
            for lane in 0..16 {
                assert!((s.get(lane) - value(lane).sin()).abs() < 2e-6);
                assert!((c.get(lane) - value(lane).cos()).abs() < 2e-6);
            }
        }
    }

    #[test]
    fn inverse_roots_are_right_to_the_last_bits() {
        for step in -40..40 {
            let value = |lane: usize| 2.0_f64.powi(step) * (1.0 + lane as f64 / 15.0 * 3.0);
            let inverse = f32x16::from_fn(value).inverse_sqrt();
            for lane in 0..16 {
                let exact = 1.0 / f64::from(value(lane) as f32).sqrt();
                assert!((inverse.get(lane) / exact - 1.0).abs() < 2e-7, "{}", value(lane));
            }
        }
    }

    #[test]
    fn select_takes_each_lane_by_its_own_mask() {
        let ramp = f32x16::from_fn(|lane| lane as f64);
        let picked = ramp.lt(f32x16::splat(8.0)).select(ramp, -ramp);
        for lane in 0..16 {
            let expected = if lane < 8 { lane as f64 } else { -(lane as f64) };
            assert_eq!(picked.get(lane), expected);
        }
        assert_eq!(ramp.lt(f32x16::splat(3.0)).bits(), 0b111);
        assert_eq!(ramp.ge(f32x16::splat(15.0)).bits(), 1 << 15);
        assert!(!ramp.gt(f32x16::splat(15.0)).any());
        assert!(ramp.ge(f32x16::splat(15.0)).any());
    }
}
