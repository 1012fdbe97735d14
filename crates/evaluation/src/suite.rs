//! Suites: lists of pulls, each with what Table II makes of it and how it relates to training.

use tasks::guidance::Behavior;

use crate::results::Group;

/// One pull of a suite.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// `f_x/f_y` in newtons: "-60/30".
    pub name: String,
    /// Force of the hand, heading frame \[N\].
    pub force: [f32; 3],
    /// How the force relates to those of training.
    pub group: Group,
}

impl Case {
    fn new(fx: i32, fy: i32, group: Group) -> Self {
        Self { name: format!("{fx}/{fy}"), force: [fx as f32, fy as f32, 0.0], group }
    }

    /// What Table II makes of it.
    pub fn behavior(&self) -> Behavior {
        Behavior::of_force(self.force)
    }

    /// Velocities asked for: v_x, v_y \[m/s\], ω_z \[rad/s\].
    pub fn target(&self) -> [f32; 3] {
        self.behavior().target(self.force)
    }

    /// The case with left and right exchanged.
    fn mirrored(&self) -> Self {
        Self::new(self.force[0] as i32, -self.force[1] as i32, self.group)
    }
}

/// Names of all suites.
pub const SUITES: [&str; 2] = ["paper17", "mirror17"];

/// The cases of a suite; `None` if there is none of that name.
///
/// `paper17` is derived from the paper's text, which fixes that there are 17 cases, their colors and three of them; the list
/// is ours. `mirror17` is the same with left and right exchanged.
pub fn suite(name: &str) -> Option<Vec<Case>> {
    use Group::{Edge, Outside, Trained};
    let paper = [
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
    .map(|(fx, fy, group)| Case::new(fx, fy, group));
    match name {
        "paper17" => Some(paper.to_vec()),
        "mirror17" => Some(paper.iter().map(Case::mirrored).collect()),
        _ => None,
    }
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
    fn the_mirror_keeps_labels_and_turns_the_other_way() {
        for (case, mirrored) in suite("paper17").unwrap().iter().zip(suite("mirror17").unwrap()) {
            assert_eq!(case.behavior(), mirrored.behavior());
            assert_eq!(case.target()[2], -mirrored.target()[2]);
        }
    }
}
