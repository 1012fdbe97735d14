//! A session as a visitor has it: pulls, tugs, two minds, a herd.

use web::{FRAME_HEADER, Network, Page, ROBOT_FIELDS, row_width};

const LOCOMOTION: &[u8] = include_bytes!("../../../policies/locomotion.onnx");
const SUPERVISOR: &[u8] = include_bytes!("../../../policies/supervisor.onnx");

fn page(settings: &str) -> Page {
    let mut page = Page::new();
    assert_eq!(page.load(LOCOMOTION), Ok(Network::Locomotion));
    assert_eq!(page.load(SUPERVISOR), Ok(Network::Supervisor));
    assert_eq!(page.configure(settings), Ok(true));
    page
}

/// The last of the frames after `seconds`.
fn after(page: &mut Page, seconds: f32) -> Vec<f32> {
    let mut frames = Vec::new();
    page.advance((seconds / 0.02).round() as u32, &mut frames).unwrap();
    let robots = frames[1] as usize;
    frames.split_off(frames.len() - FRAME_HEADER - robots * row_width())
}

fn field(frame: &[f32], robot: usize, name: &str) -> Vec<f32> {
    let mut offset = FRAME_HEADER + robot * row_width();
    for (field, width) in ROBOT_FIELDS {
        if field == name {
            return frame[offset..offset + width].to_vec();
        }
        offset += width;
    }
    panic!("no field {name}")
}

/// Walk, stop, turn, spin as a frame counts them.
const BEHAVIORS: [([f32; 3], f32); 4] =
    [([0.0, 0.0, 0.0], 0.0), ([-60.0, 0.0, 0.0], 1.0), ([0.0, 30.0, 0.0], 2.0), ([-60.0, -30.0, 0.0], 3.0)];

#[test]
fn the_dog_does_what_each_pull_means() {
    let mut page = page("{}");
    for (force, behavior) in BEHAVIORS {
        page.session().unwrap().pull(force);
        let frame = after(&mut page, 4.0);
        assert_eq!(frame[2..5], force);
        assert_eq!((frame[5], field(&frame, 0, "behavior")), (behavior, vec![behavior]), "{force:?}");
    }
    page.session().unwrap().reset();
    assert_eq!(after(&mut page, 0.02)[..5], [0.02, 1.0, 0.0, 0.0, 0.0]);
}

#[test]
fn a_tug_ends_by_itself_and_pulls_are_limited() {
    let mut page = page("{}");
    page.session().unwrap().pull([-200.0, 0.0, f32::NAN]);
    assert_eq!(after(&mut page, 0.02)[2..5], [-120.0, 0.0, -40.0]);
    page.session().unwrap().pull([0.0; 3]);
    page.session().unwrap().tug([0.0, 40.0, 0.0], 0.4);
    assert_eq!(after(&mut page, 0.4)[3], 40.0);
    assert_eq!(after(&mut page, 0.02)[3], 0.0);
}

#[test]
fn two_minds_walk_side_by_side_under_one_pull() {
    let mut page = page(r#"{"minds":["learned","dominance"]}"#);
    page.session().unwrap().pull([-60.0, 30.0, 0.0]);
    let frame = after(&mut page, 3.0);
    assert_eq!(frame[1], 2.0);
    // The dominance rule walks backwards from a strong pull; the network spins.
    assert!(field(&frame, 1, "command")[0] < 0.0 && field(&frame, 1, "command")[2] == 0.0);
    assert_eq!(field(&frame, 0, "behavior"), [3.0]);
    // Another mind takes over in mid-walk.
    assert_eq!(page.configure(r#"{"minds":["rules","dominance"],"force_noise_n":3}"#), Ok(false));
    let frame = after(&mut page, 0.2);
    assert!(field(&frame, 0, "observed_force") != frame[2..5]);
}

#[test]
fn a_herd_follows_one_pull() {
    let mut page = page(r#"{"robots":64}"#);
    page.session().unwrap().pull([-60.0, 0.0, 0.0]);
    let frame = after(&mut page, 4.0);
    let stopped = (0..64).filter(|&robot| field(&frame, robot, "behavior") == [1.0]).count();
    assert!(stopped > 57, "{stopped} of 64 stand");
}

#[test]
fn networks_and_settings_that_do_not_fit_are_refused_in_words() {
    let mut page = page("{}");
    let layer = policy::Linear { inputs: 48, outputs: 12, weight: vec![0.0; 576], bias: vec![0.0; 12] };
    let mlp = policy::Mlp { layers: vec![layer], activation: policy::Activation::Elu, output_limits: None };
    let refused = page.load(&policy::write_onnx(&mlp, &[])).unwrap_err();
    assert!(refused.contains("48 inputs") && refused.contains("235"), "{refused}");
    assert!(page.configure("{\"robots\": 0}").unwrap_err().contains("robots is 0"));
    assert!(page.configure("{\"speed\": 0}").unwrap_err().contains("unknown field `speed`"));
    assert!(page.configure("no settings").is_err());
    assert_eq!(page.session().unwrap().settings().robots, 1);
}
