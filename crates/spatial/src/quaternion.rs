//! Unit quaternions over lanes.

use crate::{lane::Lane, matrix::Mat3, vector::Vec3};

/// A unit quaternion `w + x i + y j + z k`; as an attitude `q_wb` it takes `b` to `w`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quat<L> {
    /// Scalar part.
    pub w: L,
    /// First vector component.
    pub x: L,
    /// Second vector component.
    pub y: L,
    /// Third vector component.
    pub z: L,
}

impl<L: Lane> Quat<L> {
    /// No rotation.
    #[inline(always)]
    pub fn identity() -> Self {
        Self { w: L::one(), x: L::zero(), y: L::zero(), z: L::zero() }
    }
    /// The quaternion of one lane, `[w, x, y, z]`.
    #[inline(always)]
    pub fn get(&self, lane: usize) -> [f64; 4] {
        [self.w.get(lane), self.x.get(lane), self.y.get(lane), self.z.get(lane)]
    }
    /// Replaces the quaternion of one lane, `[w, x, y, z]`.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, q: [f64; 4]) {
        self.w.set(lane, q[0]);
        self.x.set(lane, q[1]);
        self.y.set(lane, q[2]);
        self.z.set(lane, q[3]);
    }
    /// Hamilton product: first `o`, then `self`.
    #[inline(always)]
    pub fn compose(self, o: Self) -> Self {
        Self {
            w: self.w * o.w - self.x * o.x - self.y * o.y - self.z * o.z,
            x: self.w * o.x + self.x * o.w + self.y * o.z - self.z * o.y,
            y: self.w * o.y - self.x * o.z + self.y * o.w + self.z * o.x,
            z: self.w * o.z + self.x * o.y - self.y * o.x + self.z * o.w,
        }
    }
    /// Turns by the body-frame angular velocity `w_wb_b` \[rad/s\] during `dt` \[s\] and renormalizes.
    ///
    /// The increment `(1, ω dt / 2)` normalized is a rotation by `2 atan(|ω| dt / 2)`: the exponential map
    /// to second order, exact in axis.
    #[inline(always)]
    pub fn integrate(self, w_wb_b: Vec3<L>, dt: L) -> Self {
        let half = w_wb_b.scale(L::splat(0.5) * dt);
        self.compose(Self { w: L::one(), x: half.x, y: half.y, z: half.z }).normalized()
    }
    /// The quaternion scaled to unit length.
    #[inline(always)]
    pub fn normalized(self) -> Self {
        let inverse =
            L::one() / (self.w * self.w + self.x * self.x + self.y * self.y + self.z * self.z).sqrt();
        Self { w: self.w * inverse, x: self.x * inverse, y: self.y * inverse, z: self.z * inverse }
    }
    /// The rotation matrix `r_wb`.
    #[inline(always)]
    pub fn to_matrix(self) -> Mat3<L> {
        let two = L::splat(2.0);
        let one = L::one();
        let (x2, y2, z2) = (self.x * two, self.y * two, self.z * two);
        let (xx, yy, zz) = (self.x * x2, self.y * y2, self.z * z2);
        let (xy, xz, yz) = (self.x * y2, self.x * z2, self.y * z2);
        let (wx, wy, wz) = (self.w * x2, self.w * y2, self.w * z2);
        Mat3::from_columns(
            Vec3::new(one - yy - zz, xy + wz, xz - wy),
            Vec3::new(xy - wz, one - xx - zz, yz + wx),
            Vec3::new(xz + wy, yz - wx, one - xx - yy),
        )
    }
}

impl Quat<f64> {
    /// The quaternion of roll, pitch, yaw \[rad\] applied as Rz(yaw) Ry(pitch) Rx(roll).
    pub fn from_roll_pitch_yaw(roll: f64, pitch: f64, yaw: f64) -> Self {
        let (sr, cr) = (0.5 * roll).sin_cos();
        let (sp, cp) = (0.5 * pitch).sin_cos();
        let (sy, cy) = (0.5 * yaw).sin_cos();
        let about_z = Self { w: cy, x: 0.0, y: 0.0, z: sy };
        let about_y = Self { w: cp, x: 0.0, y: sp, z: 0.0 };
        let about_x = Self { w: cr, x: sr, y: 0.0, z: 0.0 };
        about_z.compose(about_y).compose(about_x)
    }
    /// The heading: yaw angle \[rad\] of the body's x axis projected on the ground.
    pub fn yaw(self) -> f64 {
        let x_axis = self.to_matrix().columns[0];
        x_axis.y.atan2(x_axis.x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matrix_and_quaternion_agree() {
        let q = Quat::from_roll_pitch_yaw(0.3, -0.7, 2.0);
        let expected = Mat3::<f64>::from_axis_angle([0.0, 0.0, 1.0], 2.0)
            * Mat3::from_axis_angle([0.0, 1.0, 0.0], -0.7)
            * Mat3::from_axis_angle([1.0, 0.0, 0.0], 0.3);
        for (a, b) in q.to_matrix().columns.iter().zip(expected.columns) {
            assert!((*a - b).norm() < 1e-14);
        }
    }

    #[test]
    fn a_constant_turn_about_z_arrives_at_the_right_yaw() {
        let mut q = Quat::from_roll_pitch_yaw(0.0, 0.0, 0.0);
        for _ in 0..200 {
            q = q.integrate(Vec3::splat([0.0, 0.0, 0.5]), 0.005);
        }
        // atan's third-order term: 200 steps of (ω dt / 2)³ · 2 / 3.
        assert!((q.yaw() - 0.5).abs() < 1e-6);
    }
}
