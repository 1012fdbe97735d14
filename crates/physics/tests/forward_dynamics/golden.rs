//! Robots and what MuJoCo computed for them (`scripts/reference/README.md` describes the files).

use std::{collections::HashMap, ops::Range, sync::Arc};

use physics::{Block, Config, Engine};
use robot::{Harness, RobotModel, anymal_d, parse_urdf};
use safetensors::{Dtype, SafeTensors, tensor::TensorView};
use spatial::Lane;
use terrain::HeightField;

/// A robot with random states of it and MuJoCo's answers.
pub(crate) struct Golden {
    pub(crate) name: &'static str,
    pub(crate) robot: RobotModel,
    pub(crate) states: usize,
    /// Width of a row, and all rows one after the other, by name.
    tensors: HashMap<String, (usize, Vec<f64>)>,
}

macro_rules! golden_of {
    ($name:literal) => {{
        let urdf = include_str!(concat!("../../../robot/tests/robots/", $name, ".urdf"));
        let robot = parse_urdf(urdf).expect("a sound description");
        Golden::read($name, robot, include_bytes!(concat!("../golden/", $name, ".safetensors")))
    }};
}

/// ANYmal D carrying the nominal harness.
pub(crate) fn anymal_d_with_harness() -> Golden {
    let robot = anymal_d().with_harness(Harness::default()).unwrap();
    Golden::read("anymal_d", robot, include_bytes!("../golden/anymal_d.safetensors"))
}

/// Every robot there are numbers for.
pub(crate) fn all() -> [Golden; 5] {
    [
        anymal_d_with_harness(),
        golden_of!("small_quadruped"),
        golden_of!("large_quadruped"),
        golden_of!("biped"),
        golden_of!("chain"),
    ]
}

impl Golden {
    fn read(name: &'static str, robot: RobotModel, bytes: &[u8]) -> Self {
        let (_, header) = SafeTensors::read_metadata(bytes).expect("a header");
        let joints: Vec<_> = robot.joints.iter().map(|joint| joint.name.as_str()).collect();
        assert_eq!(header.metadata().as_ref().expect("metadata")["joints"], joints.join(" "), "{name}");
        let file = SafeTensors::deserialize(bytes).expect("tensors");
        let tensors: HashMap<_, _> =
            file.iter().map(|(key, view)| (key.to_owned(), numbers(&view))).collect();
        let states = file.tensor("acceleration").expect("accelerations").shape()[0];
        assert!(states >= 1000, "{name}: only {states} states were read");
        Self { name, robot, states, tensors }
    }

    /// Numbers that belong to the robot.
    pub(crate) fn whole(&self, key: &str) -> &[f64] {
        &self.tensors[key].1
    }

    /// Numbers that belong to a state.
    pub(crate) fn row(&self, key: &str, state: usize) -> &[f64] {
        let (width, values) = &self.tensors[key];
        &values[state * width..][..*width]
    }

    pub(crate) fn fixed<const N: usize>(&self, key: &str, state: usize) -> [f64; N] {
        self.row(key, state).try_into().expect("as many numbers")
    }

    /// The robot high above the ground.
    pub(crate) fn engine<L: Lane>(&self, config: Config) -> Engine<L> {
        Engine::new(self.robot.clone(), Arc::new(HeightField::flat(-100.0)), config)
    }

    /// Puts a state with the force from outside into a lane of a block, and its torques into the lane of `torque`.
    pub(crate) fn load<L: Lane>(&self, block: &mut Block<L>, torque: &mut [L], lane: usize, state: usize) {
        let orientation: [f64; 4] = self.fixed("base_orientation", state);
        // Rounded to single precision, it is no longer of unit length; MuJoCo had it normalized again.
        let norm = orientation.iter().map(|x| x * x).sum::<f64>().sqrt();
        block.state.base_orientation.set(lane, orientation.map(|x| x / norm));
        block.state.base_linear_velocity.set(lane, self.fixed("base_linear_velocity", state));
        block.state.base_angular_velocity.set(lane, self.fixed("base_angular_velocity", state));
        block.input.hand_force.set(lane, self.fixed("force", state));
        for (j, torque) in torque.iter_mut().enumerate() {
            block.state.joint_position[j].set(lane, self.row("joint_position", state)[j]);
            block.state.joint_velocity[j].set(lane, self.row("joint_velocity", state)[j]);
            torque.set(lane, self.row("joint_torque", state)[j]);
        }
    }

    /// Calls `each` with all states, as many at a time as there are lanes: the first state is in lane 0.
    pub(crate) fn for_each_block<L: Lane>(
        &self,
        mut each: impl FnMut(&Engine<L>, &mut Block<L>, &[L], Range<usize>),
    ) {
        let engine = self.engine(Config::default());
        let mut block = Block::new(&engine);
        let mut torque = vec![L::zero(); engine.num_joints()];
        for start in (0..self.states).step_by(L::WIDTH) {
            let states = start..self.states.min(start + L::WIDTH);
            for state in states.clone() {
                self.load(&mut block, &mut torque, state - start, state);
            }
            each(&engine, &mut block, &torque, states);
        }
    }
}

/// Width of the last dimension, and the numbers.
fn numbers(view: &TensorView) -> (usize, Vec<f64>) {
    let bytes = view.data();
    let values = match view.dtype() {
        Dtype::F64 => bytes.as_chunks().0.iter().map(|&b| f64::from_le_bytes(b)).collect(),
        Dtype::F32 => bytes.as_chunks().0.iter().map(|&b| f64::from(f32::from_le_bytes(b))).collect(),
        other => panic!("{other:?} is neither F32 nor F64"),
    };
    (*view.shape().last().expect("a dimension"), values)
}
