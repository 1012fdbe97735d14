//! Suites: lists of pulls, each with what Table II makes of it and how it relates to training.

use tasks::guidance::Behavior;

use crate::{results::Group, script::Script};

/// One pull of a suite.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// `f_x/f_y` in newtons: "-60/30", and the script where it is not steady: "-60/30 noisy".
    pub name: String,
    /// Force of the hand, heading frame \[N\]: what the script leads to, and what is judged.
    pub force: [f32; 3],
    /// How the forces relate to those of the paper's training: the group that is farthest from them.
    pub group: Group,
    /// How the force comes about.
    pub script: Script,
}

impl Case {
    /// A steady pull.
    pub fn new(fx: f32, fy: f32, group: Group) -> Self {
        Self { name: format!("{fx}/{fy}"), force: [fx, fy, 0.0], group, script: Script::Steady }
    }

    /// Any steady pull.
    pub fn steady(fx: f32, fy: f32) -> Self {
        Self::new(fx, fy, Group::of_force([fx, fy, 0.0]))
    }

    /// A pull with a script of its own.
    fn scripted(name: &str, [fx, fy]: [f32; 2], script: Script) -> Self {
        let force = [fx, fy, 0.0];
        let groups = script.extremes(force).into_iter().map(Group::of_force);
        let group = groups.fold(Group::of_force(force), Group::max);
        Self { name: name.into(), force, group, script }
    }

    /// What Table II makes of it.
    pub fn behavior(&self) -> Behavior {
        Behavior::of_force(self.force)
    }

    /// Velocities asked for: v_x, v_y \[m/s\], ω_z \[rad/s\].
    pub fn target(&self) -> [f32; 3] {
        self.behavior().target(self.force)
    }

    /// The case with left and right exchanged; steady pulls only.
    fn mirrored(&self) -> Self {
        Self::new(self.force[0], if self.force[1] == 0.0 { 0.0 } else { -self.force[1] }, self.group)
    }
}

/// Names of all suites.
pub const SUITES: [&str; 5] = ["paper17", "mirror17", "edges", "dynamic", "plane"];

/// The cases of a suite; `None` if there is none of that name.
///
/// `paper17` is derived from the paper's text, which fixes that there are 17 cases, their colors and three of them; the list
/// is ours. `mirror17` is the same with left and right exchanged. `edges`: every threshold of Table II under a restless hand,
/// both thresholds at once, and a strong push. `dynamic`: pulls that change. `plane`: a grid over all forces
/// ([`crate::plane`] adds line scans).
pub fn suite(name: &str) -> Option<Vec<Case>> {
    match name {
        "paper17" => Some(paper17().to_vec()),
        "mirror17" => Some(paper17().iter().map(Case::mirrored).collect()),
        "edges" => Some(edges()),
        "dynamic" => Some(dynamic()),
        "plane" => Some(crate::plane::grid()),
        _ => None,
    }
}

/// Episodes of each case of a suite, where a case of others has `usual`: the plane has a hundred times as many cases.
pub fn episodes(suite: &str, usual: usize) -> usize {
    if suite == "plane" { crate::plane::EPISODES } else { usual }
}

/// Tiles of rough ground on which a suite starts ([`crate::judge::Setting::tiles`]): the plane has few episodes of each case, but
/// many cases, which are to meet as many grounds as those of other suites do.
pub fn tiles(suite: &str) -> Option<usize> {
    (suite == "plane").then_some(crate::plane::TILES)
}

fn paper17() -> [Case; 17] {
    use Group::{Edge, Outside, Trained};
    [
        (0, 0, Trained),
        (-20, 10, Trained),
        (-40, 0, Edge),
        (0, 20, Edge),
        (20, 0, Outside),
        (-60, 0, Trained),
        (-60, -10, Trained),
        (-60, 20, Edge),
        (-100, 0, Outside),
        (0, 30, Trained),
        (-20, -30, Trained),
        (-40, 30, Edge),
        (0, 50, Outside),
        (20, 50, Outside),
        (-60, 30, Trained),
        (-60, -30, Trained),
        (-100, 50, Outside),
    ]
    .map(|(fx, fy, group)| Case::new(fx as f32, fy as f32, group))
}

/// Deviation of a restless hand \[N\]. Ours.
const NOISE_N: f32 = 2.0;

/// Every edge lies on the low side of its threshold and is reached from settled walking.
fn edges() -> Vec<Case> {
    let noisy = Script::Noisy { amplitude_n: NOISE_N };
    let edges = [
        [-40.0, 0.0],
        [0.0, 20.0],
        [0.0, -20.0],
        [-60.0, 20.0],
        [-60.0, -20.0],
        [-40.0, 30.0],
        [-40.0, -30.0],
    ];
    let double = [[-40.0, 20.0], [-40.0, -20.0]];
    let name = |[x, y]: [f32; 2]| format!("{x}/{y} noisy");
    let under_noise = edges.iter().chain(&double).map(|force| Case::scripted(&name(*force), *force, noisy));
    let steady = [[-40.0, 20.0], [-40.0, -20.0], [-20.0, 50.0], [-20.0, -50.0], [60.0, 0.0]];
    let steady = steady.map(|[x, y]: [f32; 2]| Case::steady(x, y));
    under_noise.chain(steady).collect()
}

/// Steps of a person a second, with which a hand swings. Ours: about those of a usual walk.
const GAIT_HZ: f32 = 1.8;

fn dynamic() -> Vec<Case> {
    let ramp = |from: [f32; 2]| Script::Ramp { from: [from[0], from[1], 0.0], over_s: 2.0 };
    let after = |first: [f32; 2], for_s: f64| Script::After { first: [first[0], first[1], 0.0], for_s };
    let swinging = |by: [f32; 2]| Script::Swinging { by: [by[0], by[1], 0.0], hertz: GAIT_HZ };
    let none = [0.0, 0.0];
    vec![
        Case::scripted("ramp to -60/0", [-60.0, 0.0], ramp(none)),
        Case::scripted("ramp to 0/30", [0.0, 30.0], ramp(none)),
        Case::scripted("ramp to 0/-30", [0.0, -30.0], ramp(none)),
        Case::scripted("ramp to -60/30", [-60.0, 30.0], ramp(none)),
        Case::scripted("ramp from -60/0", none, ramp([-60.0, 0.0])),
        // A tug and what comes after it: the robot goes on straight, in its new direction.
        Case::scripted("tug 0/40, 0.25 s", none, after([0.0, 40.0], 0.25)),
        Case::scripted("tug 0/-40, 0.25 s", none, after([0.0, -40.0], 0.25)),
        Case::scripted("tug 0/60, 0.5 s", none, after([0.0, 60.0], 0.5)),
        Case::scripted("tug 0/-60, 0.5 s", none, after([0.0, -60.0], 0.5)),
        Case::scripted("tug -60/0, 0.5 s", none, after([-60.0, 0.0], 0.5)),
        Case::scripted("-20/0 swinging", [-20.0, 0.0], swinging([15.0, 5.0])),
        Case::scripted("-60/0 swinging", [-60.0, 0.0], swinging([15.0, 5.0])),
        Case::scripted("0/35 swinging", [0.0, 35.0], swinging([5.0, 10.0])),
        Case::scripted("-60/-35 swinging", [-60.0, -35.0], swinging([10.0, 10.0])),
        Case::scripted("0/30, then 0/-30", [0.0, -30.0], after([0.0, 30.0], 4.0)),
        Case::scripted("0/30, then -60/0", [-60.0, 0.0], after([0.0, 30.0], 4.0)),
        Case::scripted("0/-30, then none", none, after([0.0, -30.0], 4.0)),
        Case::scripted("-60/30, then -60/-30", [-60.0, -30.0], after([-60.0, 30.0], 4.0)),
        Case::scripted("-60/0, then none", none, after([-60.0, 0.0], 4.0)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paper17_has_the_labels_and_colors_of_the_derivation() {
        let cases = suite("paper17").unwrap();
        let count = |behavior| cases.iter().filter(|case| case.behavior() == behavior).count();
        assert_eq!(Behavior::ALL.map(count), [5, 4, 5, 3]);
        let count = |group| cases.iter().filter(|case| case.group == group).count();
        assert_eq!(Group::ALL.map(count), [8, 4, 5]);
        assert_eq!(cases[14].name, "-60/30");
        assert_eq!(suite("paper18"), None);
    }

    #[test]
    fn edges_lie_on_the_low_side_and_names_differ() {
        for name in SUITES {
            let cases = suite(name).unwrap();
            let mut names: Vec<&str> = cases.iter().map(|case| case.name.as_str()).collect();
            names.sort_unstable();
            names.dedup();
            assert_eq!(names.len(), cases.len(), "{name}");
        }
        for case in suite("edges").unwrap().iter().filter(|case| case.group == Group::Edge) {
            let [x, y, _] = case.force;
            assert!(x == -40.0 || y.abs() == 20.0, "{}", case.name);
            // A newton more along the axis of an edge means something else.
            let stronger = [[x - 1.0, y, 0.0], [x, y + y.signum(), 0.0]].map(Behavior::of_force);
            assert!(stronger.iter().any(|behavior| *behavior != case.behavior()), "{}", case.name);
        }
    }

    #[test]
    fn a_script_belongs_where_its_farthest_force_does() {
        let cases = suite("dynamic").unwrap();
        let group = |name: &str| cases.iter().find(|case| case.name == name).unwrap().group;
        assert_eq!(group("ramp to 0/30"), Group::Trained);
        assert_eq!(group("tug 0/40, 0.25 s"), Group::Trained);
        assert_eq!(group("tug 0/60, 0.5 s"), Group::Outside);
        assert_eq!(group("0/35 swinging"), Group::Outside, "up to 45 N");
        assert_eq!(suite("edges").unwrap()[0].group, Group::Edge, "noise is not meant");
    }

    #[test]
    fn the_mirror_keeps_labels_and_turns_the_other_way() {
        for (case, mirrored) in suite("paper17").unwrap().iter().zip(suite("mirror17").unwrap()) {
            assert_eq!(case.behavior(), mirrored.behavior());
            assert_eq!(case.target()[2], -mirrored.target()[2]);
        }
    }
}
