//! ANYmal D, built in: the description is ours, its figures the official ones
//! (`scripts/reference/mint_anymal_d.py`).

use crate::{RobotModel, parse_urdf};

/// ANYmal D without inspection payload and without harness, 51.54 kg.
pub fn anymal_d() -> RobotModel {
    parse_urdf(include_str!("../../../assets/anymal_d.urdf")).expect("the built-in description is tested")
}

/// Joint positions ANYmal D stands with \[rad\], in its joint order: LF, LH, RF, RH for HAA, then HFE, then KFE.
///
/// Source: Isaac Lab's ANYmal D (`lab_assets/anymal.py`).
pub fn anymal_d_default_joint_position() -> [f64; 12] {
    [0.0, 0.0, 0.0, 0.0, 0.4, -0.4, 0.4, -0.4, -0.8, 0.8, -0.8, 0.8]
}

#[cfg(test)]
mod tests {
    use spatial::{Mat3, Vec3};

    use super::*;
    use crate::BodyPart;

    /// Position of each foot's frame in the base, given joint positions.
    fn foot_positions(q: [f64; 12]) -> Vec<Vec3<f64>> {
        let robot = anymal_d();
        let mut poses = vec![(Mat3::<f64>::identity(), Vec3::zero())];
        for (joint, q) in robot.joints.iter().zip(q) {
            let (r, p) = poses[joint.parent_link];
            let turned = r * Mat3::from_axis_angle(joint.axis.to_array(), q);
            poses.push((turned, r * joint.origin + p));
        }
        // The sphere's center is (0, ∓0.008, 0.030) from the foot frame, whose axes are the shank's.
        let feet = robot.contacts.iter().filter(|sphere| sphere.part == BodyPart::Foot);
        feet.map(|foot| {
            let (r, p) = poses[foot.link];
            let side = if foot.name.starts_with('L') { 1.0 } else { -1.0 };
            let frame = foot.center - Vec3::splat([0.0, -0.008_141 * side, 0.030_383]);
            r * frame + p
        })
        .collect()
    }

    #[test]
    fn figures_of_the_reference() {
        let robot = anymal_d();
        assert!((robot.total_mass() - 51.54).abs() < 0.005);
        let names: Vec<_> = robot.joints.iter().map(|joint| joint.name.as_str()).collect();
        let expected = [
            "LF_HAA", "LH_HAA", "RF_HAA", "RH_HAA", "LF_HFE", "LH_HFE", "RF_HFE", "RH_HFE", "LF_KFE",
            "LH_KFE", "RF_KFE", "RH_KFE",
        ];
        assert_eq!(names, expected);
        for (j, joint) in robot.joints.iter().enumerate() {
            let axis = if j < 4 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
            assert!((joint.axis - Vec3::splat(axis)).norm() < 1e-9);
            assert_eq!(joint.effort_limit, 80.0);
        }
        assert!((robot.joints[0].position_limits.0 + 0.785).abs() < 1e-3);
        assert!((robot.joints[2].position_limits.1 - 0.785).abs() < 1e-3);
    }

    #[test]
    fn feet_are_where_the_reference_says() {
        for (foot, (x, y)) in foot_positions([0.0; 12]).iter().zip([(1, 1), (-1, 1), (1, -1), (-1, -1)]) {
            let expected = Vec3::splat([0.473 * f64::from(x), 0.3179 * f64::from(y), -0.6775]);
            assert!((*foot - expected).norm() < 1e-3, "{foot:?}");
        }
        let stance = foot_positions(anymal_d_default_joint_position());
        for (foot, (x, y)) in stance.iter().zip([(1, 1), (-1, 1), (1, -1), (-1, -1)]) {
            let expected = Vec3::splat([0.507 * f64::from(x), 0.3179 * f64::from(y), -0.585]);
            assert!((*foot - expected).norm() < 1e-3, "{foot:?}");
        }
    }
}
