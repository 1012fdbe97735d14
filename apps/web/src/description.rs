//! What the page must know of the robot and of a frame, so that it repeats no figure.

use robot::{BodyPart, Harness};
use serde_json::{Value, json};
use tasks::{
    guidance::{Behavior, COMMAND_HIGH, COMMAND_LOW, PULL_THRESHOLD_X_N, PULL_THRESHOLD_Y_N},
    simulation::{CONTROL_PERIOD_S, DECIMATION},
};

use crate::{
    session::{FORCE_HIGH, FORCE_LOW, FRAME_HEADER, ROBOT_FIELDS, row_width},
    settings::{MAX_HERD, Settings},
};

/// The seventeen pulls of the suite `paper17` \[N\].
const PRESETS: [[i32; 2]; 17] = [
    [0, 0],
    [-20, 10],
    [-40, 0],
    [0, 20],
    [20, 0],
    [-60, 0],
    [-60, -10],
    [-60, 20],
    [-100, 0],
    [0, 30],
    [-20, -30],
    [-40, 30],
    [0, 50],
    [20, 50],
    [-60, 30],
    [-60, -30],
    [-100, 50],
];

/// Frame layout, robot, harness, thresholds, presets and defaults.
pub(crate) fn describe() -> Value {
    let robot = robot::anymal_d();
    let joints: Vec<Value> = robot
        .joints
        .iter()
        .map(|joint| {
            json!({
                "name": joint.name,
                "parent": joint.parent_link,
                "origin": joint.origin.to_array(),
                "axis": joint.axis.to_array(),
            })
        })
        .collect();
    let spheres: Vec<Value> = robot
        .contacts
        .iter()
        .map(|sphere| {
            let part = match sphere.part {
                BodyPart::Foot => "foot",
                BodyPart::Shank => "shank",
                BodyPart::Knee => "knee",
                BodyPart::Thigh => "thigh",
                BodyPart::Base => "base",
                BodyPart::Hand => "hand",
            };
            json!({ "part": part, "link": sphere.link, "center": sphere.center.to_array(), "radius": sphere.radius })
        })
        .collect();
    let mut offset = 0;
    let mut fields = serde_json::Map::new();
    for (name, width) in ROBOT_FIELDS {
        fields.insert(name.into(), json!(offset));
        offset += width;
    }
    let harness = Harness::default();
    json!({
        "frame": { "header": FRAME_HEADER, "row": row_width(), "fields": fields },
        "control_period_s": CONTROL_PERIOD_S,
        "physics_rate_hz": (DECIMATION as f32 / CONTROL_PERIOD_S).round(),
        "joints": joints,
        "spheres": spheres,
        "harness": {
            "bar_start": harness.bar_start.to_array(),
            "hand_height": harness.hand_height,
            "hand_radius": harness.hand_radius,
        },
        "behaviors": Behavior::ALL.map(Behavior::name),
        "thresholds_n": [PULL_THRESHOLD_X_N, PULL_THRESHOLD_Y_N],
        "force_low_n": FORCE_LOW,
        "force_high_n": FORCE_HIGH,
        "command_low": COMMAND_LOW,
        "command_high": COMMAND_HIGH,
        "presets": PRESETS,
        "max_herd": MAX_HERD,
        "defaults": Settings::default(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presets_are_the_seventeen_cases_of_evaluation() {
        let cases = evaluation::suite::suite("paper17").unwrap();
        let forces: Vec<_> = cases.iter().map(|case| [case.force[0] as i32, case.force[1] as i32]).collect();
        assert_eq!(forces, PRESETS);
    }

    #[test]
    fn offsets_add_up_to_a_row() {
        let frame = &describe()["frame"];
        assert_eq!(frame["fields"]["fallen"].as_u64().unwrap() as usize + 1, row_width());
    }
}
