//! 3 × 3 matrices over lanes, stored by columns.

use std::ops::Mul;

use crate::{lane::Lane, vector::Vec3};

/// A 3 × 3 matrix; as a rotation `r_ab` it takes components in `b` to components in `a`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mat3<L> {
    /// The three columns.
    pub columns: [Vec3<L>; 3],
}

impl<L: Lane> Mat3<L> {
    /// A matrix from its columns.
    #[inline(always)]
    pub fn from_columns(a: Vec3<L>, b: Vec3<L>, c: Vec3<L>) -> Self {
        Self { columns: [a, b, c] }
    }
    /// The unit matrix.
    #[inline(always)]
    pub fn identity() -> Self {
        Self::from_columns(
            Vec3::splat([1.0, 0.0, 0.0]),
            Vec3::splat([0.0, 1.0, 0.0]),
            Vec3::splat([0.0, 0.0, 1.0]),
        )
    }
    /// The rotation by `angle` \[rad\] about the unit vector `axis`, the same in every lane
    /// (Rodrigues' formula).
    #[inline(always)]
    pub fn from_axis_angle(axis: [f64; 3], angle: L) -> Self {
        let (s, c) = angle.sin_cos();
        let versine = L::one() - c;
        let [x, y, z] = axis.map(L::splat);
        let (vx, vy, vz) = (versine * x, versine * y, versine * z);
        Self::from_columns(
            Vec3::new(vx.mul_add(x, c), vx.mul_add(y, s * z), vx.mul_add(z, -(s * y))),
            Vec3::new(vy.mul_add(x, -(s * z)), vy.mul_add(y, c), vy.mul_add(z, s * x)),
            Vec3::new(vz.mul_add(x, s * y), vz.mul_add(y, -(s * x)), vz.mul_add(z, c)),
        )
    }
    /// `selfᵀ v`: what undoes a rotation.
    #[inline(always)]
    pub fn transpose_mul(self, v: Vec3<L>) -> Vec3<L> {
        let [a, b, c] = self.columns;
        Vec3::new(a.dot(v), b.dot(v), c.dot(v))
    }
}

impl<L: Lane> Mul<Vec3<L>> for Mat3<L> {
    type Output = Vec3<L>;
    #[inline(always)]
    fn mul(self, v: Vec3<L>) -> Vec3<L> {
        let [a, b, c] = self.columns;
        a.scale_add(v.x, b.scale_add(v.y, c.scale(v.z)))
    }
}

impl<L: Lane> Mul for Mat3<L> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        let [a, b, c] = o.columns;
        Self::from_columns(self * a, self * b, self * c)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_transpose_of_a_rotation_undoes_it() {
        let axis = [2.0 / 7.0, -3.0 / 7.0, 6.0 / 7.0];
        let r = Mat3::<f64>::from_axis_angle(axis, 1.1);
        for (column, unit) in r.columns.iter().zip(Mat3::<f64>::identity().columns) {
            assert!((r.transpose_mul(*column) - unit).norm() < 1e-15);
        }
        // A quarter turn about z takes x to y.
        let quarter = Mat3::<f64>::from_axis_angle([0.0, 0.0, 1.0], std::f64::consts::FRAC_PI_2);
        assert!((quarter * Vec3::splat([1.0, 0.0, 0.0]) - Vec3::splat([0.0, 1.0, 0.0])).norm() < 1e-15);
    }
}
