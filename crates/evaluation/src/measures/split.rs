//! Who obeys and who does not: success by the ground under a robot and by its friction.

use serde::{Deserialize, Serialize};
use terrain::SubTerrain;

use crate::criteria::{Criterion, Miss, misses};

/// Bands of friction: each up to this value, and what it is called. Slipping begins to matter below 0.7 (docs/findings.md, "Less
/// noise at the end").
const FRICTION: [(f64, &str); 3] =
    [(0.5, "friction to 0.5"), (0.7, "friction to 0.7"), (f64::INFINITY, "friction above 0.7")];

/// What an episode met, so far as episodes of its setting differ in it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Met {
    /// Kind of the tile the robot was on when the pull set in.
    pub ground: Option<SubTerrain>,
    /// Coulomb friction of all its contacts.
    pub friction: Option<f64>,
}

impl Met {
    fn names(self) -> [Option<&'static str>; 2] {
        let band =
            |friction: f64| FRICTION.iter().find(|(up_to, _)| friction <= *up_to).map(|(_, name)| *name);
        [self.ground.map(SubTerrain::name), self.friction.and_then(band)]
    }
}

/// The episodes of a case that have something in common.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Split {
    /// What they have in common: "stairs up".
    pub of: String,
    /// How many there are.
    pub episodes: usize,
    /// Those that met the criterion of their behavior.
    pub successes: usize,
    /// The others, by what they lacked.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub misses: Vec<Miss>,
}

/// Counts episodes by what they met, kinds of ground first; what no episode met is left out. Of each: what it met, what it lacked.
pub fn splits<'a>(episodes: impl Iterator<Item = (Met, &'a [Criterion])> + Clone) -> Vec<Split> {
    let grounds = SubTerrain::ALL.map(SubTerrain::name);
    let frictions = FRICTION.map(|(_, name)| name);
    let names = grounds.into_iter().chain(frictions);
    let split = |name: &str| {
        let own = episodes.clone().filter(|(met, _)| met.names().contains(&Some(name)));
        let lacked = own.map(|(_, missed)| missed);
        Split {
            of: name.to_owned(),
            episodes: lacked.clone().count(),
            successes: lacked.clone().filter(|missed| missed.is_empty()).count(),
            misses: misses(lacked),
        }
    };
    names.map(split).filter(|split| split.episodes > 0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_episode_counts_once_for_its_ground_and_once_for_its_friction() {
        let met = |ground, friction| Met { ground: Some(ground), friction: Some(friction) };
        let slow: &[Criterion] = &[Criterion::YawRate];
        let episodes = [
            (met(SubTerrain::Boxes, 0.45), slow),
            (met(SubTerrain::Boxes, 0.7), &[]),
            (met(SubTerrain::StairsUp, 1.2), &[]),
            (Met::default(), &[]),
        ];
        let found = splits(episodes.into_iter());
        let text: Vec<_> = found.iter().map(|s| (s.of.as_str(), s.episodes, s.successes)).collect();
        let expected = [
            ("stairs up", 1, 1),
            ("boxes", 2, 1),
            ("friction to 0.5", 1, 0),
            ("friction to 0.7", 1, 1),
            ("friction above 0.7", 1, 1),
        ];
        assert_eq!(text, expected);
        let lacking: Vec<_> = found.iter().filter(|s| !s.misses.is_empty()).map(|s| s.of.as_str()).collect();
        assert_eq!(lacking, ["boxes", "friction to 0.5"]);
        assert!(splits([(Met::default(), slow)].into_iter()).is_empty());
    }
}
