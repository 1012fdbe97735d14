//! The number a kernel computes with: one `f64`, or sixteen `f32` side by side.
//!
//! A kernel written over [`Lane`] has no branch a single lane could take alone: choices go through
//! [`Mask::select`]. Instantiated for `f64` it is its own reference.

mod double;
mod sixteen;

use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

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
    /// `self * a + b`, with one rounding where the processor has the instruction; elsewhere lanes of `f32` round twice.
    fn mul_add(self, a: Self, b: Self) -> Self;
    /// `b - self * a`, rounded as [`Lane::mul_add`] is.
    fn neg_mul_add(self, a: Self, b: Self) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// One over the square root of a positive number, not always to the last bit.
    #[inline(always)]
    fn inverse_sqrt(self) -> Self {
        Self::one() / self.sqrt()
    }
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
