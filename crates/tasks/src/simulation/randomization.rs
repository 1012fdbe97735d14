//! How robots differ from one another: drawn once per environment, constant from then on.

use robot::{Harness, RobotModel};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spatial::{Inertia, Philox, Purpose, Vec3};

use crate::bounds::ordered_within;

/// Ranges of what differs between robots.
#[derive(Clone, Debug, PartialEq, JsonSchema, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Randomization {
    /// Mass added to the base, its inertia scaled alike, from and to \[kg; -20 to 50\]. Source: Isaac Lab, ±5.
    pub base_mass_kg: [f32; 2],
    /// Coulomb friction of all contacts, from and to \[1; 0 to 10\]. Source: legged_gym, 0.5 to 1.25; a little less is ours.
    pub friction: [f32; 2],
    /// Length of the harness bar, from and to \[m; 0.3 to 2\]. Source: ours, around 0.8.
    pub bar_length_m: [f32; 2],
    /// Mass of the handler's hand, from and to \[kg; 0.01 to 20\]. Source: ours, around 1.5.
    pub hand_mass_kg: [f32; 2],
}

impl Default for Randomization {
    fn default() -> Self {
        Self {
            base_mass_kg: [-5.0, 5.0],
            friction: [0.4, 1.25],
            bar_length_m: [0.6, 1.0],
            hand_mass_kg: [0.5, 3.0],
        }
    }
}

/// What one robot is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RobotConstants {
    /// Inertia of the base with harness, about the base origin.
    pub base_inertia: Inertia<f64>,
    /// Coulomb friction.
    pub friction: f64,
    /// Center of the hand in the base frame \[m\].
    pub hand_position: Vec3<f64>,
}

impl Randomization {
    /// Every robot the nominal one, with friction 0.8 (Isaac Lab's static value).
    pub fn none() -> Self {
        let harness = Harness::default();
        Self {
            base_mass_kg: [0.0; 2],
            friction: [0.8; 2],
            bar_length_m: [harness.bar_length as f32; 2],
            hand_mass_kg: [harness.hand_mass as f32; 2],
        }
    }

    /// Checks the ranges.
    ///
    /// # Errors
    /// Names the first range that is none, with what is allowed.
    pub fn validate(&self) -> Result<(), String> {
        ordered_within("randomization.base_mass_kg", self.base_mass_kg, -20.0, 50.0)?;
        ordered_within("randomization.friction", self.friction, 0.0, 10.0)?;
        ordered_within("randomization.bar_length_m", self.bar_length_m, 0.3, 2.0)?;
        ordered_within("randomization.hand_mass_kg", self.hand_mass_kg, 0.01, 20.0)
    }

    /// The robot of one environment.
    pub fn draw(&self, robot: &RobotModel, seed: u64, env: usize) -> RobotConstants {
        let mut random = Philox::new(seed, env, 0, 0, Purpose::Environment);
        let mut draw = |[low, high]: [f32; 2]| f64::from(random.uniform(low, high));
        let added_mass = draw(self.base_mass_kg);
        let friction = draw(self.friction);
        let harness = Harness {
            bar_length: draw(self.bar_length_m),
            hand_mass: draw(self.hand_mass_kg),
            ..robot.harness.unwrap_or_default()
        };
        let bare = robot.bare_base_inertia();
        let ratio = 1.0 + added_mass / bare.mass;
        let scaled = Inertia {
            mass: bare.mass * ratio,
            moment: bare.moment.scale(ratio),
            rotational: bare.rotational.map(|entry| entry * ratio),
        };
        RobotConstants {
            base_inertia: scaled + harness.inertia(),
            friction,
            hand_position: harness.hand_position(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn robots_differ_within_the_ranges_and_the_nominal_one_is_nominal() {
        let robot = robot::anymal_d().with_harness(Harness::default()).unwrap();
        let ranges = Randomization::default();
        let drawn: Vec<_> = (0..200).map(|env| ranges.draw(&robot, 1, env)).collect();
        let bare = robot.bare_base_inertia().mass;
        for one in &drawn {
            assert!((0.4..1.25).contains(&one.friction));
            assert!((bare - 5.0 + 1.0..bare + 5.0 + 3.5).contains(&one.base_inertia.mass));
        }
        assert_ne!(drawn[0], drawn[1]);
        let nominal = Randomization::none().draw(&robot, 1, 5);
        assert!((nominal.base_inertia.mass - robot.links[0].inertia.mass).abs() < 1e-9);
        assert!((nominal.hand_position - Harness::default().hand_position()).norm() < 1e-6);
    }

    #[test]
    fn ranges_out_of_order_are_named() {
        let ranges = Randomization { friction: [1.0, 0.5], ..Randomization::default() };
        assert!(ranges.validate().unwrap_err().contains("friction is [1, 0.5]"));
    }
}
