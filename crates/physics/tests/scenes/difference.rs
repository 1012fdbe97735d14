//! How far two trajectories are from each other.

use super::{CONTROL_PERIOD, Sample};

/// Kinds of numbers in a [`Sample`], each compared by itself: name, unit, how many, and what the two engines may differ
/// by even at infinitely short steps.
///
/// The floors: MuJoCo's contacts give way and creep (0.2 mm in 10 s of standing, 0.3 mm in a landing); the
/// file has five decimals; forces meet a finite number of sweeps.
pub(crate) const QUANTITIES: [Quantity; 6] = [
    Quantity { name: "x, y", unit: "mm", scale: 1e3, floor: 4e-4, read: |s| s.position[..2].to_vec() },
    Quantity { name: "height", unit: "mm", scale: 1e3, floor: 4e-4, read: |s| vec![s.position[2]] },
    // Twice the quaternion's difference is the angle of a small rotation.
    Quantity {
        name: "attitude",
        unit: "mrad",
        scale: 1e3,
        floor: 1e-3,
        read: |s| s.orientation.map(|x| 2.0 * x).to_vec(),
    },
    Quantity { name: "joints", unit: "mrad", scale: 1e3, floor: 1e-3, read: |s| s.joints.clone() },
    Quantity { name: "velocity", unit: "mm/s", scale: 1e3, floor: 2e-3, read: |s| s.velocity.to_vec() },
    Quantity { name: "force", unit: "N", scale: 1.0, floor: 1.0, read: |s| vec![s.vertical_force] },
];

/// One kind of number.
pub(crate) struct Quantity {
    pub(crate) name: &'static str,
    unit: &'static str,
    /// From SI to `unit`.
    scale: f64,
    /// In SI units.
    pub(crate) floor: f64,
    read: fn(&Sample) -> Vec<f64>,
}

/// Seconds to either side in which the fastest change counts: half a swing of a leg's spring.
const NEIGHBORHOOD: f64 = 0.1;

impl Quantity {
    /// Largest difference of any one number up to a sample.
    pub(crate) fn difference(&self, ours: &[Sample], golden: &[Sample]) -> f64 {
        ours.iter().zip(golden).map(|(a, b)| self.distance(a, b)).fold(0.0, f64::max)
    }

    /// The same counted in time steps: one is what `golden` itself changes by in `time_step`, at its fastest nearby, on
    /// top of the floor. A first-order integrator is late by about one.
    pub(crate) fn steps_off(&self, ours: &[Sample], golden: &[Sample], time_step: f64) -> f64 {
        let reach = (NEIGHBORHOOD / CONTROL_PERIOD).round() as usize;
        let change: Vec<f64> = golden.windows(2).map(|pair| self.distance(&pair[0], &pair[1])).collect();
        let off = ours.iter().zip(golden).enumerate().map(|(i, (a, b))| {
            let near = &change[i.saturating_sub(reach).min(change.len())..(i + reach).min(change.len())];
            let fastest = near.iter().copied().fold(0.0, f64::max) / CONTROL_PERIOD;
            (self.distance(a, b) - self.floor).max(0.0) / (fastest * time_step).max(1e-9)
        });
        off.fold(0.0, f64::max)
    }

    /// A difference with its unit.
    pub(crate) fn text(&self, difference: f64) -> String {
        format!("{:.1} {}", difference * self.scale, self.unit)
    }

    fn distance(&self, a: &Sample, b: &Sample) -> f64 {
        (self.read)(a).iter().zip((self.read)(b)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }
}
