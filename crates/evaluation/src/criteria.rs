//! Whether a motion is what the hand meant, and what it lacks if not.

use serde::{Deserialize, Serialize};
use tasks::guidance::Behavior;

use crate::motion::Motion;

/// What a behavior asks of a motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Criterion {
    /// To stay on its feet.
    Upright,
    /// The speed forward of one who is to go on.
    Pace,
    /// Not to go sideways.
    Sideways,
    /// To keep its heading.
    Heading,
    /// To be slow where it is to stay.
    Stillness,
    /// To be where it was at the window's beginning.
    Place,
    /// To turn as fast as told.
    YawRate,
}

impl Criterion {
    /// All of them, in the order of tables.
    pub const ALL: [Self; 7] = [
        Self::Upright,
        Self::Pace,
        Self::Sideways,
        Self::Heading,
        Self::Stillness,
        Self::Place,
        Self::YawRate,
    ];

    /// Its name in tables and files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Upright => "upright",
            Self::Pace => "pace",
            Self::Sideways => "sideways",
            Self::Heading => "heading",
            Self::Stillness => "stillness",
            Self::Place => "place",
            Self::YawRate => "yaw rate",
        }
    }
}

/// What a motion lacks of a behavior, for a robot that did not fall; nothing, if it obeyed. `target` is the velocity that Table II
/// asks for: v_x, v_y \[m/s\], ω_z \[rad/s\].
///
/// Tolerances are ours; the paper gives none.
pub fn missed(motion: &Motion, behavior: Behavior, target: [f32; 3]) -> Vec<Criterion> {
    use Criterion::{Heading, Pace, Place, Sideways, Stillness, YawRate};
    let [v_x, v_y, yaw_rate] = motion.velocity;
    let straight = (Heading, motion.heading_change.abs() <= 15.0_f64.to_radians());
    let asked = f64::from(target[2]);
    let turns =
        (YawRate, yaw_rate * asked > 0.0 && (yaw_rate - asked).abs() <= (0.25 * asked.abs()).max(0.15));
    let stays = |speed: f64, distance: f64| {
        [(Stillness, motion.planar_speed <= speed), (Place, motion.excursion <= distance)]
    };
    let demands = match behavior {
        Behavior::Walk => vec![(Pace, (v_x - 0.8).abs() <= 0.2), (Sideways, v_y.abs() <= 0.15), straight],
        Behavior::Stop => [&stays(0.10, 0.30)[..], &[straight]].concat(),
        Behavior::Turn => {
            vec![(Pace, v_x >= 0.4), turns, (Sideways, v_y.atan2(v_x).abs() <= 20.0_f64.to_radians())]
        }
        Behavior::Spin => [&stays(0.15, 0.5)[..], &[turns]].concat(),
    };
    demands.into_iter().filter(|(_, met)| !met).map(|(criterion, _)| criterion).collect()
}

/// The episodes of a case that lack the same; one may lack several things.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Miss {
    /// The criterion's name: "place".
    pub of: String,
    /// How many episodes do not meet it.
    pub episodes: usize,
}

/// Counts episodes by what they lack; what none lacks is left out.
pub fn misses<'a>(episodes: impl Iterator<Item = &'a [Criterion]> + Clone) -> Vec<Miss> {
    let count = |criterion: Criterion| Miss {
        of: criterion.name().to_owned(),
        episodes: episodes.clone().filter(|missed| missed.contains(&criterion)).count(),
    };
    Criterion::ALL.map(count).into_iter().filter(|miss| miss.episodes > 0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::tests::steady;

    #[test]
    fn every_criterion_just_inside_and_just_outside() {
        use Behavior::{Spin, Stop, Turn, Walk};
        use Criterion::{Heading, Pace, Place, Sideways, Stillness, YawRate};
        let walk = [0.8, 0.0, 0.0];
        let turn = [0.8, 0.0, 0.6];
        let spin = [0.0, 0.0, 0.6];
        // Where a fourth of what is asked for is more than 0.15 rad/s.
        let fast = [0.0, 0.0, 1.0];
        let table: [(_, _, [f32; 3], &[Criterion]); 28] = [
            (Walk, walk, [0.61, 0.0, 0.0], &[]),
            (Walk, walk, [0.59, 0.0, 0.0], &[Pace]),
            (Walk, walk, [0.99, 0.0, 0.0], &[]),
            (Walk, walk, [1.01, 0.0, 0.0], &[Pace]),
            (Walk, walk, [0.8, 0.14, 0.0], &[]),
            (Walk, walk, [0.8, 0.16, 0.0], &[Sideways]),
            // 15° over 6 s are 0.0436 rad/s.
            (Walk, walk, [0.8, 0.0, 0.043], &[]),
            (Walk, walk, [0.8, 0.0, 0.045], &[Heading]),
            (Stop, [0.0; 3], [0.0, 0.0, 0.0], &[]),
            // 0.30 m in 6 s.
            (Stop, [0.0; 3], [0.049, 0.0, 0.0], &[]),
            (Stop, [0.0; 3], [0.052, 0.0, 0.0], &[Place]),
            (Stop, [0.0; 3], [0.11, 0.0, 0.0], &[Stillness, Place]),
            (Stop, [0.0; 3], [0.0, 0.0, -0.05], &[Heading]),
            (Turn, turn, [0.41, 0.0, 0.46], &[]),
            (Turn, turn, [0.39, 0.0, 0.6], &[Pace]),
            (Turn, turn, [0.8, 0.0, 0.44], &[YawRate]),
            (Turn, turn, [0.8, 0.0, -0.6], &[YawRate]),
            // 20° are a slope of 0.364.
            (Turn, turn, [0.8, 0.286, 0.6], &[]),
            (Turn, turn, [0.8, 0.296, 0.6], &[Sideways]),
            (Spin, spin, [0.0, 0.0, 0.74], &[]),
            (Spin, spin, [0.0, 0.0, 0.76], &[YawRate]),
            (Spin, fast, [0.0, 0.0, 0.76], &[]),
            (Spin, fast, [0.0, 0.0, 0.74], &[YawRate]),
            (Spin, fast, [0.0, 0.0, 1.24], &[]),
            (Spin, fast, [0.0, 0.0, 1.26], &[YawRate]),
            (Spin, spin, [0.0, 0.0, -0.6], &[YawRate]),
            (Spin, spin, [0.14, 0.0, 0.6], &[]),
            (Spin, spin, [0.16, 0.0, 0.6], &[Stillness, Place]),
        ];
        for (behavior, target, [v_x, v_y, yaw_rate], expected) in table {
            let motion = Motion::of(&steady(v_x, v_y, yaw_rate), target[2]);
            let found = missed(&motion, behavior, target);
            assert_eq!(found, expected, "{behavior} {v_x} {v_y} {yaw_rate}");
        }
    }

    #[test]
    fn an_episode_counts_for_all_it_lacks() {
        let episodes: [&[Criterion]; 3] = [&[], &[Criterion::Place, Criterion::YawRate], &[Criterion::Place]];
        let found = misses(episodes.into_iter());
        let text: Vec<_> = found.iter().map(|miss| (miss.of.as_str(), miss.episodes)).collect();
        assert_eq!(text, [("place", 2), ("yaw rate", 1)]);
    }
}
