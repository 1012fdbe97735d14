//! Which level a robot meets next.

use spatial::Philox;

use crate::tile::TILE_SIZE_M;

/// The level of the next episode, `0..levels`.
///
/// One up after walking more than half a tile from the start; otherwise one down after less than half the way that
/// was commanded; past the top, anywhere at random, so that no level is forgotten. The rule of Rudin et al., *Learning
/// to walk in minutes using massively parallel deep reinforcement learning* (CoRL 2021), as in Isaac Lab
/// (`velocity/mdp/curriculums.py`).
///
/// `level` is the one just walked, `distance_m` horizontal from the start to where the episode ended,
/// `commanded_speed_mps` the horizontal speed commanded at the end, `levels` at least 1.
pub fn next_level(
    level: usize,
    distance_m: f64,
    commanded_speed_mps: f64,
    episode_length_s: f64,
    levels: usize,
    random: &mut Philox,
) -> usize {
    let next = if distance_m > 0.5 * TILE_SIZE_M {
        level + 1
    } else if distance_m < 0.5 * commanded_speed_mps * episode_length_s {
        level.saturating_sub(1)
    } else {
        level
    };
    if next < levels { next } else { random.below(levels as u32) as usize }
}

#[cfg(test)]
mod tests {
    use super::*;
    use spatial::Purpose;

    fn next(level: usize, distance_m: f64, speed_mps: f64) -> usize {
        let mut random = Philox::new(0, 0, 0, 0, Purpose::Evaluation);
        next_level(level, distance_m, speed_mps, 20.0, 10, &mut random)
    }

    #[test]
    fn the_rule_on_and_beside_its_thresholds() {
        // (level, distance, speed, next): half a tile is 4 m; at 0.3 m/s half the commanded way is 3 m.
        let table = [
            (4, 4.01, 0.3, 5),
            (4, 4.0, 0.3, 4),
            (4, 3.0, 0.3, 4),
            (4, 2.99, 0.3, 3),
            (4, 0.0, 0.0, 4),
            (0, 0.1, 1.0, 0),
            (0, 5.0, 1.0, 1),
            (8, 5.0, 1.0, 9),
            // Half a tile is enough, however far was commanded.
            (4, 4.01, 1.0, 5),
            (4, 3.99, 1.0, 3),
        ];
        for (level, distance_m, speed_mps, expected) in table {
            assert_eq!(next(level, distance_m, speed_mps), expected, "{level} {distance_m} {speed_mps}");
        }
    }

    #[test]
    fn past_the_top_every_level_is_drawn() {
        let mut random = Philox::new(1, 0, 0, 0, Purpose::Evaluation);
        let mut seen = [0; 10];
        for _ in 0..1000 {
            seen[next_level(9, 5.0, 1.0, 20.0, 10, &mut random)] += 1;
        }
        assert!(seen.iter().all(|&n| (60..140).contains(&n)), "{seen:?}");
    }

    #[test]
    fn a_distance_that_is_not_a_number_keeps_the_level() {
        assert_eq!(next(4, f64::NAN, 1.0), 4);
    }
}
