//! The harness: a rigid bar on the base with the handler's hand at its end.

use spatial::{Inertia, Vec3};

use crate::{
    RobotError,
    model::{BodyPart, ContactSphere, Harness, RobotModel},
};

impl Default for Harness {
    /// Our own figures: 0.8 m and 0.5 kg of bar, a hand of 1.5 kg.
    fn default() -> Self {
        Self {
            bar_start: Vec3::splat([-0.45, 0.0, 0.10]),
            bar_length: 0.8,
            bar_mass: 0.5,
            hand_height: 0.315,
            hand_mass: 1.5,
            hand_radius: 0.04,
        }
    }
}

impl Harness {
    /// Center of the hand in the base frame \[m\]: straight back from the fixing and up to the hand's height.
    pub fn hand_position(&self) -> Vec3<f64> {
        let rise = self.hand_height - self.bar_start.z;
        let back = (self.bar_length * self.bar_length - rise * rise).max(0.0).sqrt();
        Vec3::splat([self.bar_start.x - back, self.bar_start.y, self.hand_height])
    }

    /// Inertia of bar (uniform thin rod) and hand (solid sphere) about the base origin, base frame.
    pub fn inertia(&self) -> Inertia<f64> {
        let hand = self.hand_position();
        let along = (hand - self.bar_start).scale(1.0 / self.bar_length);
        let rod = self.bar_mass * self.bar_length * self.bar_length / 12.0;
        let [x, y, z] = along.to_array();
        // m l² / 12 (1 − u uᵀ) about the rod's center.
        let rod = [1.0 - x * x, 1.0 - y * y, 1.0 - z * z, -x * y, -x * z, -y * z].map(|entry| rod * entry);
        let center = (self.bar_start + hand).scale(0.5);
        let ball = 0.4 * self.hand_mass * self.hand_radius * self.hand_radius;
        Inertia::from_center_of_mass(self.bar_mass, center, rod)
            + Inertia::from_center_of_mass(self.hand_mass, hand, [ball, ball, ball, 0.0, 0.0, 0.0])
    }

    /// Checks that such a bar can be built.
    ///
    /// # Errors
    /// The first value that cannot be, and what is allowed.
    pub fn validate(&self) -> Result<(), RobotError> {
        let positive = [
            ("bar_length", self.bar_length),
            ("bar_mass", self.bar_mass),
            ("hand_mass", self.hand_mass),
            ("hand_radius", self.hand_radius),
        ];
        for (name, value) in positive {
            if !(value.is_finite() && value > 0.0) {
                return Err(RobotError::value("harness", name, value, "finite and above 0"));
            }
        }
        let Vec3 { x, y, z } = self.bar_start;
        let places =
            [("bar_start x", x), ("bar_start y", y), ("bar_start z", z), ("hand_height", self.hand_height)];
        for (name, value) in places {
            if !value.is_finite() {
                return Err(RobotError::value("harness", name, value, "finite"));
            }
        }
        let rise = (self.hand_height - z).abs();
        if rise >= self.bar_length {
            let allowed = format!("above {rise}, the rise from bar_start to hand_height");
            return Err(RobotError::value("harness", "bar_length", self.bar_length, &allowed));
        }
        Ok(())
    }
}

impl RobotModel {
    /// The robot carrying a harness: its base gains the harness's inertia and the contacts the hand, after
    /// the feet. Replaces a harness already there.
    ///
    /// # Errors
    /// What [`Harness::validate`] refuses.
    pub fn with_harness(mut self, harness: Harness) -> Result<Self, RobotError> {
        harness.validate()?;
        self.links[0].inertia = self.bare_base_inertia() + harness.inertia();
        self.contacts.retain(|sphere| sphere.part != BodyPart::Hand);
        let feet = self.contacts.iter().filter(|sphere| sphere.part == BodyPart::Foot).count();
        let hand = ContactSphere {
            name: "HAND".to_owned(),
            link: 0,
            center: harness.hand_position(),
            radius: harness.hand_radius,
            part: BodyPart::Hand,
        };
        self.contacts.insert(feet, hand);
        self.harness = Some(harness);
        Ok(self)
    }

    /// Inertia of the base without the harness, about the base origin.
    pub fn bare_base_inertia(&self) -> Inertia<f64> {
        let mut bare = self.links[0].inertia;
        if let Some(harness) = &self.harness {
            let carried = harness.inertia();
            bare.mass -= carried.mass;
            bare.moment -= carried.moment;
            for (mine, other) in bare.rotational.iter_mut().zip(carried.rotational) {
                *mine -= other;
            }
        }
        bare
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anymal_d;

    #[test]
    fn the_hand_is_where_the_design_puts_it() {
        let harness = Harness::default();
        let hand = harness.hand_position();
        assert!(((hand - harness.bar_start).norm() - 0.8).abs() < 1e-12);
        assert_eq!(hand.z, 0.315);
        // Back by √(0.8² − 0.215²) = 0.770568 m.
        assert!((hand.x + 1.220_568).abs() < 1e-6);
    }

    #[test]
    fn masses_add_and_balance() {
        let harness = Harness::default();
        let carried = harness.inertia();
        assert_eq!(carried.mass, 2.0);
        let center = carried.center_of_mass();
        let hand = harness.hand_position();
        let expected = (harness.bar_start + hand).scale(0.5 * 0.25) + hand.scale(0.75);
        assert!((center - expected).norm() < 1e-12);
        let robot = anymal_d();
        let bare = robot.links[0].inertia;
        let robot = robot.with_harness(harness).unwrap();
        assert!((robot.total_mass() - 53.54).abs() < 0.005);
        assert!((robot.bare_base_inertia().mass - bare.mass).abs() < 1e-12);
        assert_eq!(robot.contacts[4].name, "HAND");
    }

    #[test]
    fn what_is_not_finite_is_refused_by_its_name() {
        let refuse = |change: fn(&mut Harness)| {
            let mut harness = Harness::default();
            change(&mut harness);
            harness.validate().expect_err("cannot be built").to_string()
        };
        assert_eq!(refuse(|h| h.bar_start.x = f64::NAN), "harness: bar_start x is `NaN`, must be finite");
        assert_eq!(
            refuse(|h| h.bar_start.y = f64::INFINITY),
            "harness: bar_start y is `inf`, must be finite"
        );
        assert_eq!(refuse(|h| h.bar_start.z = f64::NAN), "harness: bar_start z is `NaN`, must be finite");
        assert_eq!(refuse(|h| h.hand_height = f64::NAN), "harness: hand_height is `NaN`, must be finite");
    }

    #[test]
    fn a_bar_too_short_for_its_height_is_refused() {
        let harness = Harness { bar_length: 0.2, ..Harness::default() };
        let error = anymal_d().with_harness(harness).unwrap_err().to_string();
        assert!(error.contains("bar_length") && error.contains("0.2"), "{error}");
    }
}
