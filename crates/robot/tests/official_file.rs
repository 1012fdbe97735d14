//! Our description of ANYmal D beside the official one (ANYbotics, `anymal_d_simple_description`), which is not part of the
//! project: its 97 links are merged by our reader, and every figure must be that of `assets/anymal_d.urdf`.
//!
//! The file is taken from the environment variable `GUIDEDOG_OFFICIAL_URDF`, else from
//! `../shared/robots/anymal_d/anymal.urdf` beside the repository. Skips, saying so, where there is none.

use std::{
    io::{Write as _, stderr},
    path::PathBuf,
};

use robot::{BodyPart, RobotModel, anymal_d, parse_urdf};
use roxmltree::{Document, Node};

/// What the official robot carries on its back and ours does not.
const PAYLOAD: &str = "inspection_payload";
/// Of the largest number of a vector; ours is printed with ten significant digits.
const TOLERANCE: f64 = 1e-9;

/// The official file's text, or a word on why the test is skipped.
fn official_text() -> Option<String> {
    let beside = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/robots/anymal_d/anymal.urdf");
    let path = std::env::var_os("GUIDEDOG_OFFICIAL_URDF").map_or_else(|| beside.into(), PathBuf::from);
    let text = std::fs::read_to_string(&path);
    if let Err(error) = &text {
        let skipped = format!(
            "skipped: the official description is not at hand: {}: {error}; set GUIDEDOG_OFFICIAL_URDF\n",
            path.display()
        );
        // Not by a macro, whose output the test harness keeps back: that nothing was compared must be seen.
        let _ = stderr().write_all(skipped.as_bytes());
    }
    text.ok()
}

/// Whether an element is a link of the payload or a joint that carries one.
fn is_payload(node: &Node) -> bool {
    let name = match node.tag_name().name() {
        "link" => node.attribute("name"),
        "joint" => node.children().find(|c| c.has_tag_name("child")).and_then(|c| c.attribute("link")),
        _ => None,
    };
    name.is_some_and(|name| name.contains(PAYLOAD))
}

/// The text without the payload.
fn without_payload(text: &str) -> String {
    let document = Document::parse(text).expect("XML");
    let mut kept = String::new();
    let mut from = 0;
    for node in document.root_element().children().filter(is_payload) {
        kept.push_str(&text[from..node.range().start]);
        from = node.range().end;
    }
    assert!(from > 0, "no link or joint has `{PAYLOAD}` in its name");
    kept + &text[from..]
}

/// The official robot as we read it, and ours.
fn both() -> Option<(RobotModel, RobotModel)> {
    let official = parse_urdf(&without_payload(&official_text()?)).expect("the official file is read");
    Some((official, anymal_d()))
}

#[track_caller]
fn assert_close(what: &str, official: &[f64], ours: &[f64]) {
    assert_eq!(official.len(), ours.len(), "{what}");
    let scale = official.iter().fold(0.0, |scale: f64, number| scale.max(number.abs()));
    for (a, b) in official.iter().zip(ours) {
        assert!((a - b).abs() <= TOLERANCE * scale, "{what}: official {official:?}, ours {ours:?}");
    }
}

#[test]
fn the_mass_is_that_of_all_its_links() {
    let Some(text) = official_text() else { return };
    let text = without_payload(&text);
    let document = Document::parse(&text).unwrap();
    let masses = document.descendants().filter(|node| node.has_tag_name("mass"));
    let sum: f64 = masses.map(|mass| mass.attribute("value").unwrap().parse::<f64>().unwrap()).sum();
    assert_close("total mass", &[sum], &[anymal_d().total_mass()]);
}

#[test]
fn bodies_weigh_what_their_links_weigh_together() {
    let Some((official, ours)) = both() else { return };
    assert_eq!(official.links.len(), ours.links.len());
    for (a, b) in official.links.iter().zip(&ours.links) {
        assert_eq!(a.name, b.name);
        assert_close(&format!("mass of {}", a.name), &[a.inertia.mass], &[b.inertia.mass]);
        let (center, our_center) = (a.inertia.center_of_mass(), b.inertia.center_of_mass());
        assert_close(&format!("center of {}", a.name), &center.to_array(), &our_center.to_array());
        assert_close(&format!("inertia of {}", a.name), &a.inertia.rotational, &b.inertia.rotational);
    }
}

#[test]
fn joints_turn_where_and_as_far_as_the_official_ones() {
    let Some((official, ours)) = both() else { return };
    assert_eq!(official.joints.len(), 12);
    assert_eq!(ours.joints.len(), 12);
    for (a, b) in official.joints.iter().zip(&ours.joints) {
        assert_eq!((&a.name, a.kind, a.parent_link), (&b.name, b.kind, b.parent_link));
        assert_close(&format!("origin of {}", a.name), &a.origin.to_array(), &b.origin.to_array());
        assert_close(&format!("axis of {}", a.name), &a.axis.to_array(), &b.axis.to_array());
        let limits =
            |j: &robot::Joint| [j.position_limits.0, j.position_limits.1, j.effort_limit, j.velocity_limit];
        assert_close(&format!("limits of {}", a.name), &limits(a), &limits(b));
    }
}

#[test]
fn feet_are_the_official_spheres() {
    let Some((official, ours)) = both() else { return };
    let feet = ours.contacts_of(BodyPart::Foot);
    assert_eq!(feet.len(), 4);
    for foot in feet.into_iter().map(|i| &ours.contacts[i]) {
        let is_same = |sphere: &&robot::ContactSphere| {
            sphere.link == foot.link
                && (sphere.center - foot.center).norm() < TOLERANCE
                && (sphere.radius - foot.radius).abs() < TOLERANCE
        };
        assert!(official.contacts.iter().any(|sphere| is_same(&sphere)), "{foot:?}");
    }
}
