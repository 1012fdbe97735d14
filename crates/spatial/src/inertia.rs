//! Rigid-body inertia about an arbitrary point.

use std::ops::Add;

use crate::{lane::Lane, matrix::Mat3, vector::Vec3};

/// Mass, first and second moment of a rigid body about the origin of the frame they are expressed in.
///
/// Inertias about the same point in the same axes simply add, which is why the dynamics keeps every link's
/// inertia in the base frame (Featherstone, *Rigid Body Dynamics Algorithms*, 2008, section 2.13).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inertia<L> {
    /// Mass \[kg\].
    pub mass: L,
    /// Mass times center of mass \[kg m\].
    pub moment: Vec3<L>,
    /// Rotational inertia about the origin, `[xx, yy, zz, xy, xz, yz]` \[kg m²\].
    pub rotational: [L; 6],
}

impl<L: Lane> Inertia<L> {
    /// No mass.
    #[inline(always)]
    pub fn zero() -> Self {
        Self { mass: L::zero(), moment: Vec3::zero(), rotational: [L::zero(); 6] }
    }

    /// From mass, center of mass and inertia about the center of mass (`[xx, yy, zz, xy, xz, yz]`).
    #[inline(always)]
    pub fn from_center_of_mass(mass: L, center: Vec3<L>, about_center: [L; 6]) -> Self {
        let c = center;
        let m = mass;
        let [xx, yy, zz, xy, xz, yz] = about_center;
        Self {
            mass,
            moment: c.scale(m),
            rotational: [
                m.mul_add(c.y * c.y + c.z * c.z, xx),
                m.mul_add(c.x * c.x + c.z * c.z, yy),
                m.mul_add(c.x * c.x + c.y * c.y, zz),
                m.neg_mul_add(c.x * c.y, xy),
                m.neg_mul_add(c.x * c.z, xz),
                m.neg_mul_add(c.y * c.z, yz),
            ],
        }
    }

    /// The same body about the origin of frame `a`, where this inertia is about the origin of `b`,
    /// `r_ab` turns `b` into `a` and `p_ab` is the origin of `b` in `a`.
    #[inline(always)]
    pub fn transformed(&self, r_ab: Mat3<L>, p_ab: Vec3<L>) -> Self {
        self.rotated(r_ab).shifted(p_ab)
    }

    /// The same body about the same point, along the axes of `a`, where `r_ab` turns the present axes into those.
    #[inline(always)]
    pub fn rotated(&self, r_ab: Mat3<L>) -> Self {
        let [xx, yy, zz, xy, xz, yz] = self.rotational;
        let rotational =
            Mat3::from_columns(Vec3::new(xx, xy, xz), Vec3::new(xy, yy, yz), Vec3::new(xz, yz, zz));
        let turned = r_ab * rotational;
        // turned · r_abᵀ, upper triangle only.
        let row = |i: usize| {
            let [a, b, c] = turned.columns;
            Vec3::new(a.to_array()[i], b.to_array()[i], c.to_array()[i])
        };
        let [a, b, c] = r_ab.columns;
        let axis = |i: usize| Vec3::new(a.to_array()[i], b.to_array()[i], c.to_array()[i]);
        let (x, y, z) = (axis(0), axis(1), axis(2));
        let (rx, ry, rz) = (row(0), row(1), row(2));
        Self {
            mass: self.mass,
            moment: r_ab * self.moment,
            rotational: [rx.dot(x), ry.dot(y), rz.dot(z), rx.dot(y), rx.dot(z), ry.dot(z)],
        }
    }

    /// The same body along the same axes about the origin of `a`, from which the present one is `p_ab` away.
    #[inline(always)]
    pub fn shifted(&self, p_ab: Vec3<L>) -> Self {
        let (m, h, p) = (self.mass, self.moment, p_ab);
        let [xx, yy, zz, xy, xz, yz] = self.rotational;
        // Parallel-axis theorem with the first moment h about the old origin:
        // I' = I + (2 p·h + m p·p) 1 − (p hᵀ + h pᵀ + m p pᵀ).
        let diagonal = L::splat(2.0).mul_add(p.dot(h), m * p.dot(p));
        let mixed = |pi: L, hi: L, pj: L, hj: L| pi.mul_add(hj, hi.mul_add(pj, m * pi * pj));
        Self {
            mass: m,
            moment: p.scale_add(m, h),
            rotational: [
                xx + diagonal - mixed(p.x, h.x, p.x, h.x),
                yy + diagonal - mixed(p.y, h.y, p.y, h.y),
                zz + diagonal - mixed(p.z, h.z, p.z, h.z),
                xy - mixed(p.x, h.x, p.y, h.y),
                xz - mixed(p.x, h.x, p.z, h.z),
                yz - mixed(p.y, h.y, p.z, h.z),
            ],
        }
    }

    /// Momentum of the body moving with angular velocity `angular` and origin velocity `linear`:
    /// (angular momentum about the origin, linear momentum).
    #[inline(always)]
    pub fn momentum(&self, angular: Vec3<L>, linear: Vec3<L>) -> (Vec3<L>, Vec3<L>) {
        let spin = self.spin(angular);
        (spin + self.moment.cross(linear), linear.scale_add(self.mass, angular.cross(self.moment)))
    }

    /// The rotational inertia times an angular velocity.
    #[inline(always)]
    fn spin(&self, w: Vec3<L>) -> Vec3<L> {
        let [xx, yy, zz, xy, xz, yz] = self.rotational;
        Vec3::new(
            xx.mul_add(w.x, xy.mul_add(w.y, xz * w.z)),
            xy.mul_add(w.x, yy.mul_add(w.y, yz * w.z)),
            xz.mul_add(w.x, yz.mul_add(w.y, zz * w.z)),
        )
    }

    /// [`Inertia::momentum`] of the body turning about its origin.
    #[inline(always)]
    pub fn momentum_turning(&self, angular: Vec3<L>) -> (Vec3<L>, Vec3<L>) {
        (self.spin(angular), angular.cross(self.moment))
    }

    /// [`Inertia::momentum`] of the body that does not turn.
    #[inline(always)]
    pub fn momentum_sliding(&self, linear: Vec3<L>) -> (Vec3<L>, Vec3<L>) {
        (self.moment.cross(linear), linear.scale(self.mass))
    }

    /// Replaces the inertia of one lane.
    pub fn set(&mut self, lane: usize, inertia: &Inertia<f64>) {
        self.mass.set(lane, inertia.mass);
        self.moment.set(lane, inertia.moment.to_array());
        for (mine, new) in self.rotational.iter_mut().zip(inertia.rotational) {
            mine.set(lane, new);
        }
    }
}

impl Inertia<f64> {
    /// The same inertia in every lane.
    pub fn broadcast<L: Lane>(&self) -> Inertia<L> {
        Inertia {
            mass: L::splat(self.mass),
            moment: Vec3::splat(self.moment.to_array()),
            rotational: self.rotational.map(L::splat),
        }
    }

    /// Center of mass \[m\]; zero for a massless body.
    pub fn center_of_mass(&self) -> Vec3<f64> {
        if self.mass == 0.0 { Vec3::zero() } else { self.moment.scale(1.0 / self.mass) }
    }
}

impl<L: Lane> Add for Inertia<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        let (a, b) = (self.rotational, o.rotational);
        Self {
            mass: self.mass + o.mass,
            moment: self.moment + o.moment,
            rotational: [a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4], a[5] + b[5]],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moving_a_body_equals_moving_its_points() {
        // Four point masses stand for any body; transform the inertia, or transform the points.
        let points = [
            ([0.1, 0.4, -0.2], 1.5),
            ([-0.3, 0.0, 0.7], 0.4),
            ([0.0, -0.6, 0.1], 2.0),
            ([0.5, 0.5, 0.5], 1.0),
        ];
        let sum = |map: &dyn Fn(Vec3<f64>) -> Vec3<f64>| {
            points.iter().fold(Inertia::zero(), |total, (p, m)| {
                total + Inertia::from_center_of_mass(*m, map(Vec3::splat(*p)), [0.0; 6])
            })
        };
        let r = Mat3::from_axis_angle([0.6, 0.0, 0.8], 0.9);
        let p = Vec3::splat([0.2, -1.0, 0.4]);
        let moved = sum(&|x| x).transformed(r, p);
        let expected = sum(&|x| r * x + p);
        for (a, b) in moved.rotational.iter().zip(expected.rotational) {
            assert!((a - b).abs() < 1e-13);
        }
        assert!((moved.moment - expected.moment).norm() < 1e-13);
    }

    #[test]
    fn momentum_is_the_sum_over_points() {
        let (p, m) = (Vec3::splat([0.1, 0.4, -0.2]), 1.5);
        let (w, v) = (Vec3::splat([1.0, -2.0, 0.5]), Vec3::splat([0.3, 0.1, -0.4]));
        let (angular, linear) = Inertia::from_center_of_mass(m, p, [0.0; 6]).momentum(w, v);
        let velocity = v + w.cross(p);
        assert!((linear - velocity.scale(m)).norm() < 1e-15);
        assert!((angular - p.cross(velocity.scale(m))).norm() < 1e-15);
    }
}
