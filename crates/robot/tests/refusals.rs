//! What a description may not be: each refusal names the element.

use robot::parse_urdf;

const INERTIAL: &str =
    r#"<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>"#;

fn link(name: &str) -> String {
    format!(r#"<link name="{name}">{INERTIAL}</link>"#)
}

fn joint(name: &str, kind: &str, parent: &str, child: &str) -> String {
    format!(
        r#"<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/><axis xyz="0 1 0"/>
        <limit lower="-1" upper="1" effort="10" velocity="5"/></joint>"#
    )
}

fn refusal(body: &str) -> String {
    match parse_urdf(&format!(r#"<robot name="r">{body}</robot>"#)) {
        Ok(_) => panic!("was accepted: {body}"),
        Err(error) => error.to_string(),
    }
}

#[track_caller]
fn assert_names(message: &str, words: &[&str]) {
    for word in words {
        assert!(message.contains(word), "`{message}` does not say `{word}`");
    }
}

#[test]
fn a_sound_robot_is_read() {
    let text = link("a")
        + &link("b")
        + &link("c")
        + &joint("j", "fixed", "a", "b")
        + &joint("k", "revolute", "b", "c");
    let robot = parse_urdf(&format!(r#"<robot name="r">{text}</robot>"#)).unwrap();
    assert_eq!(robot.links.len(), 2);
    assert_eq!(robot.links[0].inertia.mass, 2.0);
    assert_eq!(robot.joints[0].position_limits, (-1.0, 1.0));
}

#[test]
fn structure_is_checked() {
    assert_names(&refusal(""), &["no links"]);
    assert_names(&refusal(&(link("a") + &link("b"))), &["`a`", "`b`", "root"]);
    assert_names(&refusal(&(link("a") + &link("a"))), &["`a`", "twice"]);
    assert_names(&refusal(&(link("a") + &joint("j", "fixed", "a", "x"))), &["`j`", "`x`"]);
    assert_names(&refusal(&(link("a") + &joint("j", "fixed", "x", "a"))), &["`j`", "`x`"]);
    let two_parents =
        link("a") + &link("b") + &link("c") + &joint("j", "fixed", "a", "c") + &joint("k", "fixed", "b", "c");
    assert_names(&refusal(&two_parents), &["`k`", "`c`", "`j`"]);
    let circle = link("a") + &link("b") + &joint("j", "fixed", "a", "b") + &joint("k", "fixed", "b", "a");
    assert_names(&refusal(&circle), &["loop"]);
    let apart = link("r") + &circle;
    assert_names(&refusal(&apart), &["loop", "`a`"]);
    let same =
        link("a") + &link("b") + &link("c") + &joint("j", "fixed", "a", "b") + &joint("j", "fixed", "b", "c");
    assert_names(&refusal(&same), &["`j`", "twice"]);
}

#[test]
fn joints_are_checked() {
    let with = |joint: &str| refusal(&(link("a") + &link("b") + joint));
    assert_names(&with(&joint("j", "floating", "a", "b")), &["`j`", "floating", "revolute"]);
    let good = joint("j", "revolute", "a", "b");
    assert_names(&with(&good.replace("0 1 0", "0 0 0")), &["`j`", "axis"]);
    // Its length overflows.
    assert_names(&with(&good.replace("0 1 0", "0 1e200 0")), &["`j`", "axis", "0 1e200 0", "finite length"]);
    assert_names(&with(&good.replace("0 1 0", "0 one 0")), &["`j`", "axis", "0 one 0"]);
    assert_names(&with(&good.replace(r#"lower="-1""#, r#"lower="2""#)), &["`j`", "limit"]);
    assert_names(&with(&good.replace(r#"effort="10""#, "")), &["`j`", "effort"]);
    assert_names(&with(&good.replace(r#"effort="10""#, r#"effort="nan""#)), &["`j`", "effort", "nan"]);
    assert_names(&with(&good.replace(r#"<child link="b"/>"#, "")), &["`j`", "child"]);
}

#[test]
fn a_joint_that_follows_another_is_refused() {
    let mimic = r#"<mimic joint="i" multiplier="-1"/><axis"#;
    let follower = |kind| joint("j", kind, "b", "c").replace("<axis", mimic);
    let body = link("a") + &link("b") + &link("c") + &joint("i", "revolute", "a", "b");
    let message = refusal(&(body.clone() + &follower("revolute")));
    assert_eq!(message, "joint `j`: <mimic> is `i`, must be absent, as no joint can follow another");
    // One that is fixed follows nothing.
    assert!(parse_urdf(&format!(r#"<robot name="r">{body}{}</robot>"#, follower("fixed"))).is_ok());
}

#[test]
fn inertias_are_checked() {
    let with = |link: &str| refusal(&(self::link("a") + link + &joint("j", "revolute", "a", "b")));
    assert_names(&with(r#"<link name="b"/>"#), &["`b`", "mass"]);
    let good = link("b");
    assert_names(&with(&good.replace(r#"mass value="1""#, r#"mass value="-1""#)), &["`b`", "mass", "-1"]);
    assert_names(&with(&good.replace(r#"ixx="1""#, r#"ixx="0""#)), &["`b`", "inertia"]);
    assert_names(&with(&good.replace(r#"ixx="1""#, r#"ixx="5""#)), &["`b`", "inertia", "sum"]);
    assert_names(&with(&good.replace(r#"ixy="0""#, r#"ixy="3""#)), &["`b`", "positive definite"]);
    assert_names(&with(&good.replace(r#"ixy="0""#, "")), &["`b`", "ixy"]);
    // Principal moments 5, 1 and 1, turned by 45°.
    let turned = r#"ixx="3" ixy="2" ixz="0" iyy="3""#;
    let turned = good.replace(r#"ixx="1" ixy="0" ixz="0" iyy="1""#, turned);
    assert_names(&with(&turned), &["`b`", "ixy 2.000e0", "sum"]);
    // Far away a moment of inertia overflows, and about the center is no number.
    let far = good.replace("<inertial>", r#"<inertial><origin xyz="1e200 0 0"/>"#);
    assert_names(&with(&far), &["`b`", "inertia", "NaN", "positive definite"]);
    let heavy = good.replace(r#"mass value="1""#, r#"mass value="1e308""#);
    let twice = heavy.clone() + &heavy.replace(r#""b""#, r#""c""#) + &joint("k", "fixed", "b", "c");
    assert_names(&with(&twice), &["`b`", "mass", "inf", "finite"]);
}

#[test]
fn boxes_have_three_edges() {
    for size in ["0 1 1", "1 -1 1", "1 1"] {
        let collision = format!(r#"<collision><geometry><box size="{size}"/></geometry></collision>"#);
        assert_names(
            &refusal(&link("a").replace("<inertial>", &(collision + "<inertial>"))),
            &["`a`", "size", size],
        );
    }
}

#[test]
fn shapes_that_are_not_read_are_refused_but_for_meshes() {
    let with = |shape: &str| {
        let collision = format!("<collision><geometry>{shape}</geometry></collision><inertial>");
        link("a").replace("<inertial>", &collision)
    };
    for (shape, found) in [
        (r#"<capsule radius="0.1" length="1"/>"#, "`capsule`"),
        (r#"<shpere radius="0.1"/>"#, "`shpere`"),
        (" <!-- nothing --> ", "`empty`"),
    ] {
        assert_names(&refusal(&with(shape)), &["`a`", "<geometry>", found, "sphere, box or cylinder"]);
    }
    let mesh = format!(r#"<robot name="r">{}</robot>"#, with(r#"<mesh filename="a.dae"/>"#));
    assert!(parse_urdf(&mesh).unwrap().contacts.is_empty());
}

#[test]
fn broken_files_are_refused_wherever_they_break() {
    let whole = include_str!("../../../assets/anymal_d.urdf");
    for end in (0..whole.len() - 10).step_by(97) {
        assert!(parse_urdf(&whole[..end]).is_err(), "cut at {end}");
    }
    assert!(parse_urdf("<model/>").unwrap_err().to_string().contains("model"));
    let missing = robot::load_urdf(std::path::Path::new("/no/such/file.urdf")).unwrap_err().to_string();
    assert!(missing.contains("/no/such/file.urdf"));
}
