//! Robots of many shapes (`robots/`): what is read of them must be the robot that was meant.

use robot::{BodyPart, Harness, JointKind, RobotModel, parse_urdf};
use spatial::Vec3;

fn small_quadruped() -> RobotModel {
    parse_urdf(include_str!("robots/small_quadruped.urdf")).unwrap()
}
fn large_quadruped() -> RobotModel {
    parse_urdf(include_str!("robots/large_quadruped.urdf")).unwrap()
}
fn biped() -> RobotModel {
    parse_urdf(include_str!("robots/biped.urdf")).unwrap()
}
fn chain() -> RobotModel {
    parse_urdf(include_str!("robots/chain.urdf")).unwrap()
}

/// Where a contact sphere is at zero joint positions, when all frames are parallel to the base's.
fn place(robot: &RobotModel, contact: usize) -> Vec3<f64> {
    let sphere = &robot.contacts[contact];
    let mut position = sphere.center;
    let mut link = sphere.link;
    while link > 0 {
        position += robot.joints[link - 1].origin;
        link = robot.joints[link - 1].parent_link;
    }
    position
}

/// Number of joints that hang on each link.
fn branches(robot: &RobotModel) -> Vec<usize> {
    let on = |link| robot.joints.iter().filter(|joint| joint.parent_link == link).count();
    (0..robot.links.len()).map(on).collect()
}

#[test]
fn masses_and_branches_are_those_of_the_files() {
    let cases = [
        (small_quadruped(), 15.0, 12, &[4, 1, 1, 1, 1][..]),
        (large_quadruped(), 50.06, 12, &[4, 1, 1, 1, 1]),
        (biped(), 54.1, 19, &[3, 1, 1, 2]), // pelvis with hips and waist; hips; torso with shoulders
        (chain(), 13.6, 6, &[1, 1, 1, 1, 1, 1, 0]),
    ];
    for (robot, mass, joints, first_branches) in cases {
        assert!((robot.total_mass() - mass).abs() < 1e-9, "{}: {} kg", robot.name, robot.total_mass());
        assert_eq!(robot.joints.len(), joints, "{}", robot.name);
        assert!(branches(&robot).starts_with(first_branches), "{}: {:?}", robot.name, branches(&robot));
    }
}

#[test]
fn feet_stand_at_the_corners_of_a_rectangle_whatever_frames_they_are_given_in() {
    for robot in [small_quadruped(), large_quadruped()] {
        let feet: Vec<_> = robot.contacts_of(BodyPart::Foot).into_iter().map(|i| place(&robot, i)).collect();
        assert_eq!(feet.len(), 4, "{}", robot.name);
        for (x, y) in [(1.0, -1.0), (-1.0, 1.0)] {
            for foot in &feet {
                let image = Vec3::new(x * foot.x, y * foot.y, foot.z);
                let nearest = feet.iter().map(|other| (*other - image).norm()).fold(f64::MAX, f64::min);
                assert!(nearest < 1e-3, "{}: no foot is the image of {foot:?}", robot.name);
            }
        }
        assert!(feet.iter().all(|foot| foot.z < -0.3), "{}: {feet:?}", robot.name);
    }
}

#[test]
fn joints_of_every_kind_are_read() {
    let robot = chain();
    let kinds: Vec<_> = robot.joints.iter().map(|joint| joint.kind).collect();
    let (turns, slides) = (JointKind::Revolute, JointKind::Prismatic);
    assert_eq!(kinds, [turns, turns, slides, turns, turns, turns]);
    assert_eq!(robot.joints[0].position_limits, (f64::NEG_INFINITY, f64::INFINITY), "continuous");
    assert_eq!(robot.joints[2].position_limits, (-0.1, 0.25));
    assert_eq!(robot.joints[1].armature, 0.0);
    for joint in &robot.joints {
        assert!((joint.axis.norm() - 1.0).abs() < 1e-15, "{}", joint.name);
    }
    // What is fixed to the arm is part of it.
    assert!((robot.links[4].inertia.mass - 1.4).abs() < 1e-12);
}

#[test]
fn contacts_of_one_name_are_told_apart() {
    let inertia = r#"<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>"#;
    let sphere = r#"<collision name="collision"><geometry><sphere radius="0.1"/></geometry></collision>"#;
    let link = |name| {
        format!(r#"<link name="{name}"><inertial><mass value="1"/>{inertia}</inertial>{sphere}</link>"#)
    };
    let fixed = |child| {
        format!(r#"<joint name="{child}" type="fixed"><parent link="a"/><child link="{child}"/></joint>"#)
    };
    let text = ["a", "b", "c"].map(link).concat() + &["b", "c"].map(fixed).concat();
    let robot = parse_urdf(&format!(r#"<robot name="r">{text}</robot>"#)).unwrap();
    let names: Vec<_> = robot.contacts.iter().map(|sphere| sphere.name.as_str()).collect();
    assert_eq!(names, ["collision", "collision_0", "collision_1"]);
}

/// The handler's hand is known to the dynamics by its part; a robot's own hands took its place.
#[test]
fn own_hands_are_not_the_handlers() {
    let hands = |robot: &RobotModel| -> Vec<_> {
        robot
            .contacts
            .iter()
            .filter(|sphere| sphere.name.contains("hand"))
            .map(|sphere| sphere.link)
            .collect()
    };
    let robot = biped();
    assert!(robot.contacts_of(BodyPart::Hand).is_empty());
    let links = hands(&robot);
    assert!(links.len() == 2 && links[0] != links[1], "{links:?}");
    let carrying = robot.with_harness(Harness::default()).unwrap();
    assert_eq!(hands(&carrying), links);
    assert_eq!(carrying.contacts_of(BodyPart::Hand).len(), 1);
}
