//! Which spheres of a block are near the ground, and what they may touch there.
//!
//! A sphere that is near in half of the lanes or more is held against the ground where it is. Of the others only those lanes
//! are in which they are near: as pairs of sphere and lane, packed into full bundles. What a pair gets does not depend on
//! whom it is packed with, nor on which of the two ways it went.

use spatial::{Lane, Mask, Mat3, Vec3};

use crate::{
    bias::LinkMotion,
    block::Block,
    engine::Engine,
    ground::{self, Ceiling, FACES, Proximity},
    kinematics::LinkKinematics,
};

/// One sphere in all lanes.
#[derive(Clone, Debug)]
pub(crate) struct Found<L> {
    /// Whether in some lane it is near the ground; otherwise the rest is old.
    pub(crate) near: bool,
    /// Center, base frame \[m\].
    pub(crate) center: Vec3<L>,
    /// Velocity of the center, base frame \[m/s\].
    pub(crate) velocity: Vec3<L>,
    /// What it may touch, world frame; far where it is not near.
    pub(crate) faces: [Proximity<L>; FACES],
}

/// Pairs of a sphere and a lane, as many as there are lanes.
#[derive(Clone, Debug)]
struct Bundle<L> {
    place: Place<L>,
    pairs: Vec<Pair>,
}

#[derive(Clone, Copy, Debug)]
struct Pair {
    sphere: usize,
    lane: usize,
}

/// A sphere over the map.
#[derive(Clone, Copy, Debug)]
struct Place<L> {
    /// World frame \[m\].
    center: Vec3<L>,
    radius: L,
    /// What every gap is at least \[m\].
    least: L,
}

/// Scratch memory of the search.
#[derive(Clone, Debug)]
pub(crate) struct Search<L> {
    /// One a sphere.
    pub(crate) found: Vec<Found<L>>,
    bundles: Vec<Bundle<L>>,
    active: usize,
}

impl<L: Lane> Search<L> {
    pub(crate) fn new(spheres: usize) -> Self {
        let found = Found {
            near: false,
            center: Vec3::zero(),
            velocity: Vec3::zero(),
            faces: [Proximity::none(); FACES],
        };
        let place = Place { center: Vec3::zero(), radius: L::zero(), least: L::zero() };
        let bundle = |_| Bundle { place, pairs: Vec::with_capacity(L::WIDTH) };
        Self { found: vec![found; spheres], bundles: (0..spheres).map(bundle).collect(), active: 0 }
    }

    /// Fills [`Search::found`].
    #[inline(never)]
    pub(crate) fn run(
        &mut self,
        engine: &Engine<L>,
        block: &Block<L>,
        r_wb: Mat3<L>,
        links: &[LinkKinematics<L>],
        motion: &[LinkMotion<L>],
    ) {
        let Block { state, parameters, .. } = block;
        let structure = engine.structure();
        let dt = L::splat(engine.config.time_step);
        let margin = L::splat(engine.config.contact_margin);
        let ceiling = Ceiling::over(engine.map(), state.base_position);
        let up = Vec3::new(r_wb.columns[0].z, r_wb.columns[1].z, r_wb.columns[2].z);
        self.active = 0;
        for (i, (sphere, found)) in structure.spheres.iter().zip(&mut self.found).enumerate() {
            found.near = false;
            let link = &links[sphere.link];
            let offset = link.r_bl * sphere.center_in_link(parameters);
            let center = offset + link.p_bl;
            let radius = L::broadcast(sphere.radius);
            if !ceiling.is_reached(up.dot(center), radius, center) {
                continue;
            }
            let center_w = r_wb * center + state.base_position;
            let velocity = motion[sphere.link].velocity_of(offset);
            // Nothing further away can be closed within the step, whatever its direction.
            let reach = velocity.norm().mul_add(dt, margin).min(L::splat(ground::REACH));
            let least = ground::least_gap(engine.map(), center_w, radius);
            let near = least.lt(reach);
            let lanes = near.bits();
            if lanes == 0 {
                continue;
            }
            (found.near, found.center, found.velocity) = (true, center, velocity);
            let place = Place { center: center_w, radius, least };
            if 2 * lanes.count_ones() as usize >= L::WIDTH {
                found.faces = place.faces(engine).map(|face| face.only_where(near));
            } else {
                found.faces = [Proximity::none(); FACES];
                pack(&mut self.bundles, &mut self.active, i, lanes, &place);
            }
        }
        self.look_at_pairs(engine);
    }

    /// Holds all pairs against the ground.
    #[inline(always)]
    fn look_at_pairs(&mut self, engine: &Engine<L>) {
        let bundles = self.active.div_ceil(L::WIDTH);
        for bundle in &self.bundles[..bundles] {
            let faces = bundle.place.faces(engine);
            for (k, face) in faces.iter().enumerate() {
                let mut near = face.gap.lt(ground::far()).bits();
                while near != 0 {
                    let from = near.trailing_zeros() as usize;
                    near &= near - 1;
                    // Behind the last pair lanes are idle.
                    let Some(&Pair { sphere, lane }) = bundle.pairs.get(from) else { break };
                    let to = &mut self.found[sphere].faces[k];
                    to.gap.set(lane, face.gap.get(from));
                    to.normal.set(lane, face.normal.get(from));
                }
            }
        }
    }
}

impl<L: Lane> Place<L> {
    #[inline(always)]
    fn faces(&self, engine: &Engine<L>) -> [Proximity<L>; FACES] {
        ground::faces(engine.map(), self.center, self.radius, self.least)
    }
}

/// Appends the lanes of a sphere, given as bits, to the pairs.
#[inline(always)]
fn pack<L: Lane>(
    bundles: &mut [Bundle<L>],
    active: &mut usize,
    sphere: usize,
    mut lanes: u32,
    place: &Place<L>,
) {
    while lanes != 0 {
        let lane = lanes.trailing_zeros() as usize;
        lanes &= lanes - 1;
        let to = *active % L::WIDTH;
        let bundle = &mut bundles[*active / L::WIDTH];
        *active += 1;
        if to == 0 {
            bundle.pairs.clear();
            // What idles must be a place, too.
            bundle.place = *place;
        }
        bundle.pairs.push(Pair { sphere, lane });
        let packed = &mut bundle.place;
        packed.center.set(to, place.center.get(lane));
        packed.radius.set(to, place.radius.get(lane));
        packed.least.set(to, place.least.get(lane));
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use robot::{Harness, anymal_d, anymal_d_default_joint_position};
    use spatial::{Philox, Purpose, Quat, f32x16};
    use terrain::HeightField;

    use super::*;
    use crate::{Config, kinematics::forward_kinematics, step, workspace::Workspace};

    const LANE: usize = 5;

    /// Scattered heights where x is negative, steps elsewhere.
    fn engine<L: Lane>() -> Engine<L> {
        let mut random = Philox::new(1, 0, 0, 0, Purpose::Terrain);
        let mut cell = |i: usize| {
            let top = random.uniform(0.0, 0.08);
            if i % 40 < 20 { std::array::from_fn(|_| random.uniform(0.0, 0.08)) } else { [top; 4] }
        };
        let cells = (0..1600).map(&mut cell).collect();
        let ground = HeightField { cell_size: 0.1, origin: [-2.0; 2], columns: 40, rows: 40, cells };
        let robot = anymal_d().with_harness(Harness::default()).expect("the nominal harness can be built");
        Engine::new(robot, Arc::new(ground), Config::default())
    }

    /// What a robot finds in one lane, all others being `above` it, sphere by sphere: gaps and normals.
    fn found<L: Lane>(
        engine: &Engine<L>,
        robot: usize,
        lane: usize,
        above: f64,
    ) -> Vec<Option<[[f64; 4]; FACES]>> {
        let mut random = Philox::new(2, robot, 0, 0, Purpose::Evaluation);
        let mut draw = |width: f32| f64::from(random.uniform(-width, width));
        let mut block = Block::new(engine);
        let (position, q) = ([draw(1.2), draw(1.2), 0.45 + draw(0.15)], [draw(0.4), draw(0.4), draw(3.0)]);
        let q = Quat::from_roll_pitch_yaw(q[0], q[1], q[2]);
        for i in 0..L::WIDTH {
            let z = position[2] + if i == lane { 0.0 } else { above };
            block.state.base_position.set(i, [position[0], position[1], z]);
            block.state.base_orientation.set(i, [q.w, q.x, q.y, q.z]);
        }
        for (to, q) in block.state.joint_position.iter_mut().zip(anymal_d_default_joint_position()) {
            *to = L::splat(q);
        }
        let velocity = [draw(4.0), draw(4.0), draw(4.0)];
        block.state.base_linear_velocity = Vec3::splat(velocity);
        let mut w = Workspace::new(engine);
        let r_wb = block.state.base_orientation.to_matrix();
        forward_kinematics(engine.structure(), &block.parameters, &block.state, &mut w.links);
        step::bias(engine, &block.state, r_wb, &mut w);
        w.search.run(engine, &block, r_wb, &w.links, &w.motion);
        // Where nothing is, the direction is of no interest.
        let face = |face: &Proximity<L>| {
            let [x, y, z] = face.normal.get(lane);
            let gap = face.gap.get(lane);
            if gap < 1e3 { [gap, x, y, z] } else { [gap; 4] }
        };
        w.search
            .found
            .iter()
            .map(|found| found.near.then(|| [0, 1, 2].map(|k| face(&found.faces[k]))))
            .collect()
    }

    #[test]
    fn packed_pairs_get_what_whole_bundles_get_and_the_scalar_does() {
        let (lanes, scalar) = (engine::<f32x16>(), engine::<f64>());
        let (mut near, mut several) = (0, 0);
        for robot in 0..200 {
            let together = found(&lanes, robot, LANE, 0.0);
            let alone = found(&lanes, robot, LANE, 50.0);
            assert!(together == alone, "robot {robot}:\n{together:?}\n{alone:?}");
            let plain = found(&scalar, robot, 0, 0.0);
            for (packed, plain) in alone.iter().zip(&plain) {
                let gap = |faces: &Option<[[f64; 4]; FACES]>| {
                    faces.map_or(1e3, |faces| faces.iter().fold(1e3, |least, face| face[0].min(least)))
                };
                // Within a millimeter of the reach the two may differ in what is near.
                if gap(plain) < 0.009 {
                    assert!((gap(packed) - gap(plain)).abs() < 1e-4, "robot {robot}: {packed:?} {plain:?}");
                    near += 1;
                }
            }
            several += usize::from(alone.iter().flatten().count() > 2);
        }
        assert!(near > 300 && several > 100, "{near} near, {several} robots with more than two");
    }
}
