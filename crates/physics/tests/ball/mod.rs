//! A ball, and grounds made of cells, whose motion can be worked out by hand.
#![allow(dead_code, reason = "no test uses all of it")]

use std::sync::Arc;

use physics::{Block, Config, Engine};
use robot::{BodyPart, ContactSphere, Link, RobotModel};
use spatial::{Inertia, Vec3};
use terrain::HeightField;

/// A solid ball of 1 kg that touches the ground with all of its surface.
fn ball(radius: f64) -> RobotModel {
    let about_center = 0.4 * radius * radius;
    let inertia = Inertia::from_center_of_mass(
        1.0,
        Vec3::zero(),
        [about_center, about_center, about_center, 0.0, 0.0, 0.0],
    );
    let surface = ContactSphere {
        name: "surface".to_owned(),
        link: 0,
        center: Vec3::zero(),
        radius,
        part: BodyPart::Base,
    };
    RobotModel {
        name: "ball".to_owned(),
        links: vec![Link { name: "ball".to_owned(), inertia }],
        joints: vec![],
        contacts: vec![surface],
        harness: None,
    }
}

/// 32 × 32 cells from the origin on, by their column and row.
pub(crate) fn cells(cell_size: f32, cell: impl Fn(usize, usize) -> terrain::Cell) -> HeightField {
    let cells = (0..32 * 32).map(|i| cell(i % 32, i / 32)).collect();
    HeightField { cell_size, origin: [0.0, 0.0], columns: 32, rows: 32, cells }
}

/// A ball on its ground.
pub(crate) struct Roller {
    pub(crate) engine: Engine<f64>,
    pub(crate) block: Block<f64>,
}

impl Roller {
    /// A ball without friction and at rest in the given position \[m\].
    pub(crate) fn new(radius: f64, ground: HeightField, config: Config, position: [f64; 3]) -> Self {
        let engine = Engine::new(ball(radius), Arc::new(ground), config);
        let mut block = Block::new(&engine);
        block.state.base_position = Vec3::splat(position);
        block.parameters.friction = 0.0;
        Self { engine, block }
    }

    /// Its velocity in the world \[m/s\]; the attitude must still be that of the world.
    pub(crate) fn moving(mut self, velocity: [f64; 3]) -> Self {
        self.block.state.base_linear_velocity = Vec3::splat(velocity);
        self
    }

    pub(crate) fn with_friction(mut self, friction: f64) -> Self {
        self.block.parameters.friction = friction;
        self
    }

    pub(crate) fn step(&mut self) {
        self.block.step(&self.engine);
    }

    pub(crate) fn position(&self) -> Vec3<f64> {
        self.block.state.base_position
    }

    /// Velocity of the center in the world \[m/s\].
    pub(crate) fn velocity(&self) -> Vec3<f64> {
        self.block.state.base_orientation.to_matrix() * self.block.state.base_linear_velocity
    }
}
