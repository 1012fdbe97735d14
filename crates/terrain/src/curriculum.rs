//! Which level a robot meets next.

use spatial::Philox;

use crate::tile::TILE_SIZE_M;

/// The level of the next episode, `0..levels`.
///
/// One down after making good less than half the way that was commanded; otherwise one up after more than half a tile;
/// past the top, anywhere at random, so that no level is forgotten. After Rudin et al., *Learning to walk in minutes using
/// massively parallel deep reinforcement learning* (CoRL 2021) and Isaac Lab (`velocity/mdp/curriculums.py`), with three
/// differences. They take the distance between the episode's ends and the speed commanded last; under commands that change
/// every few seconds that tells little, so `progress_m` is the way made good along the commands and `commanded_m` the way
/// commanded, both along the path \[m\]. They let half a tile outweigh any command; here a robot that does not do
/// half of what it is told goes down however far it drifted. And they ask for half the way of a whole episode, so that an early fall sends
/// a robot down; here both ways end with the fall, which costs reward and no level.
pub fn next_level(
    level: usize,
    progress_m: f64,
    commanded_m: f64,
    levels: usize,
    random: &mut Philox,
) -> usize {
    let next = if progress_m < 0.5 * commanded_m {
        level.saturating_sub(1)
    } else if progress_m > 0.5 * TILE_SIZE_M {
        level + 1
    } else {
        level
    };
    if next < levels { next } else { random.below(levels as u32) as usize }
}

#[cfg(test)]
mod tests {
    use super::*;
    use spatial::Purpose;

    fn next(level: usize, progress_m: f64, commanded_m: f64) -> usize {
        let mut random = Philox::new(0, 0, 0, 0, Purpose::Evaluation);
        next_level(level, progress_m, commanded_m, 10, &mut random)
    }

    #[test]
    fn the_rule_on_and_beside_its_thresholds() {
        // (level, progress, commanded, next): half a tile is 4 m.
        let table = [
            (4, 4.01, 6.0, 5),
            (4, 4.0, 6.0, 4),
            (4, 3.0, 6.0, 4),
            (4, 2.99, 6.0, 3),
            (4, 0.0, 0.0, 4),
            (0, 0.1, 20.0, 0),
            (0, 5.0, 6.0, 1),
            (8, 5.0, 10.0, 9),
            // Far, but not where it was told.
            (4, 5.0, 20.0, 3),
        ];
        for (level, progress, commanded, expected) in table {
            assert_eq!(next(level, progress, commanded), expected, "{level} {progress} {commanded}");
        }
    }

    #[test]
    fn past_the_top_every_level_is_drawn() {
        let mut random = Philox::new(1, 0, 0, 0, Purpose::Evaluation);
        let mut seen = [0; 10];
        for _ in 0..1000 {
            seen[next_level(9, 5.0, 6.0, 10, &mut random)] += 1;
        }
        assert!(seen.iter().all(|&n| (60..140).contains(&n)), "{seen:?}");
    }

    #[test]
    fn a_distance_that_is_not_a_number_keeps_the_level() {
        assert_eq!(next(4, f64::NAN, 1.0), 4);
    }
}
