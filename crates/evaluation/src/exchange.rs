//! Episodes for another engine to play, and what it recorded: files of the same safetensors layout as checkpoints.
//!
//! A plan knows no suites: robots with their constants and first states, a ground, and the force of the hand at every
//! control step. A record answers with one sample a step. So whatever can play forces can be judged on every suite, and
//! both engines' episodes are the same ones. `docs/engines.md` has the tensors' names, shapes and units.

use policy::Checkpoint;
use tasks::{guidance::Course, simulation::Randomization};

use crate::recording::{Recording, Sample};

/// What one robot is to undergo.
pub(crate) struct Planned {
    /// x, y, z of the base \[m\], heading \[rad\].
    pub(crate) start: [f32; 4],
    /// Linear and angular velocity of the base at the start, base frame \[m/s\], \[rad/s\].
    pub(crate) velocity: [f32; 6],
    /// Joint positions at the start \[rad\], our order.
    pub(crate) joint_position: [f32; 12],
    /// Force of the hand at every control step, heading frame \[N\].
    pub(crate) force: Vec<[f32; 3]>,
}

/// Writes a plan: `setting` are header entries that come back with the record.
pub(crate) fn plan(
    course: &Course,
    randomization: &Randomization,
    robots: &[Planned],
    setting: &[(&str, String)],
) -> Checkpoint {
    let mut file = Checkpoint::default();
    let count = robots.len();
    let longest = robots.iter().map(|robot| robot.force.len()).max().unwrap_or(0);
    let mut put = |name: &str, shape: Vec<usize>, values: Vec<f32>| {
        file.tensors.insert(name.into(), (shape, values));
    };
    put("start", vec![count, 4], robots.iter().flat_map(|r| r.start).collect());
    put("start_velocity", vec![count, 6], robots.iter().flat_map(|r| r.velocity).collect());
    put("joint_position", vec![count, 12], robots.iter().flat_map(|r| r.joint_position).collect());
    put("steps", vec![count], robots.iter().map(|r| r.force.len() as f32).collect());
    let padded = |robot: &Planned| {
        let rest = std::iter::repeat_n([0.0; 3], longest - robot.force.len());
        robot.force.iter().copied().chain(rest).flatten().collect::<Vec<f32>>()
    };
    put("force", vec![count, longest, 3], robots.iter().flat_map(padded).collect());
    let constants: Vec<_> =
        (0..count).map(|robot| randomization.draw(course.simulation.robot(), course.seed, robot)).collect();
    let inertia = |c: &tasks::simulation::RobotConstants| {
        let i = &c.base_inertia;
        let all = [i.mass].into_iter().chain(i.moment.to_array()).chain(i.rotational);
        all.map(|value| value as f32).collect::<Vec<_>>()
    };
    put("base_inertia", vec![count, 10], constants.iter().flat_map(inertia).collect());
    put("friction", vec![count], constants.iter().map(|c| c.friction as f32).collect());
    let hand = |c: &tasks::simulation::RobotConstants| c.hand_position.to_array().map(|x| x as f32);
    put("hand_position", vec![count, 3], constants.iter().flat_map(hand).collect());
    let ground = course.simulation.engine.terrain();
    let cells = ground.cells.iter().flatten().copied().collect();
    put("ground", vec![ground.rows, ground.columns, 4], cells);
    let [x, y] = ground.origin;
    put("ground_frame", vec![3], vec![x, y, ground.cell_size]);
    file.header = setting.iter().map(|(name, value)| ((*name).to_owned(), value.clone())).collect();
    file
}

/// Numbers of a sample in a record: v_x, v_y, ω_z, x, y, yaw, command, fallen.
const RECORDED: usize = 10;

/// The recordings of a record, one a robot, with the forces of their plan.
///
/// # Errors
/// A tensor is missing, of another shape, or holds what is no number.
pub fn recordings(record: &Checkpoint) -> Result<Vec<Recording>, String> {
    let tensor =
        |name: &str| record.tensors.get(name).ok_or_else(|| format!("the record has no tensor `{name}`"));
    let (shape, samples) = tensor("samples")?;
    let &[robots, longest, RECORDED] = shape.as_slice() else {
        return Err(format!("`samples` is {shape:?}, must be robots × steps × {RECORDED}"));
    };
    let (force_shape, force) = tensor("force")?;
    let (steps_shape, lengths) = tensor("steps")?;
    if *force_shape != [robots, longest, 3] || *steps_shape != [robots] {
        return Err(format!(
            "`force` is {force_shape:?} and `steps` {steps_shape:?}, must be those of the plan of {robots} robots"
        ));
    }
    (0..robots)
        .map(|robot| {
            let count = lengths[robot] as usize;
            if count > longest {
                return Err(format!("robot {robot} has {count} steps, the record {longest}"));
            }
            let from = robot * longest;
            let rows = samples[from * RECORDED..].chunks_exact(RECORDED);
            let forces = force[from * 3..].chunks_exact(3);
            recording(rows.zip(forces).take(count)).map_err(|message| format!("robot {robot}: {message}"))
        })
        .collect()
}

fn recording<'a>(rows: impl Iterator<Item = (&'a [f32], &'a [f32])>) -> Result<Recording, String> {
    let mut recording = Recording::default();
    for (step, (row, force)) in rows.enumerate() {
        if row.iter().chain(force).any(|value| !value.is_finite()) {
            return Err(format!("step {step} holds what is no number"));
        }
        let three = |from: usize| [row[from], row[from + 1], row[from + 2]];
        let (mut sample, fallen) = (
            Sample {
                velocity: three(0),
                position: [row[3], row[4]],
                yaw: row[5],
                command: three(6),
                force: [force[0], force[1], force[2]],
            },
            row[9] != 0.0,
        );
        if fallen {
            recording.fell_at.get_or_insert(step);
            let last = recording.samples.last().copied().unwrap_or(sample);
            sample = Sample { velocity: [0.0; 3], position: last.position, yaw: last.yaw, ..sample };
        } else if let Some(last) = recording.samples.last() {
            let turns = ((last.yaw - sample.yaw) / std::f32::consts::TAU).round();
            sample.yaw += turns * std::f32::consts::TAU;
        }
        recording.samples.push(sample);
    }
    Ok(recording)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(rows: &[[f32; RECORDED]]) -> Checkpoint {
        let mut file = Checkpoint::default();
        file.tensors.insert("samples".into(), (vec![1, rows.len(), RECORDED], rows.concat()));
        file.tensors.insert("force".into(), (vec![1, rows.len(), 3], vec![-60.0; rows.len() * 3]));
        file.tensors.insert("steps".into(), (vec![1], vec![rows.len() as f32]));
        file
    }

    #[test]
    fn headings_go_on_beyond_a_half_turn_and_the_fallen_stay_where_they_fell() {
        let row = |x: f32, yaw: f32, fallen: f32| [0.5, 0.0, 0.1, x, 0.0, yaw, 0.8, 0.0, 0.6, fallen];
        let found =
            recordings(&record(&[row(1.0, 3.1, 0.0), row(1.1, -3.1, 0.0), row(1.2, 0.0, 1.0)])).unwrap();
        let [first, second, third] = found[0].samples[..] else { panic!("three samples") };
        assert_eq!(
            (first.velocity, first.command, first.force),
            ([0.5, 0.0, 0.1], [0.8, 0.0, 0.6], [-60.0; 3])
        );
        assert!((second.yaw - (std::f32::consts::TAU - 3.1)).abs() < 1e-6);
        assert_eq!((third.velocity, third.position, third.yaw), ([0.0; 3], [1.1, 0.0], second.yaw));
        assert_eq!(found[0].fell_at, Some(2));
    }

    #[test]
    fn what_does_not_fit_is_named() {
        let mut file = record(&[[0.0; RECORDED]]);
        file.tensors.get_mut("samples").unwrap().1[4] = f32::NAN;
        assert_eq!(recordings(&file).unwrap_err(), "robot 0: step 0 holds what is no number");
        let mut pulled = record(&[[0.0; RECORDED]]);
        pulled.tensors.get_mut("force").unwrap().1[1] = f32::INFINITY;
        assert_eq!(recordings(&pulled).unwrap_err(), "robot 0: step 0 holds what is no number");
        file.tensors.remove("steps");
        assert!(recordings(&file).unwrap_err().contains("`steps`"));
        assert!(recordings(&Checkpoint::default()).unwrap_err().contains("`samples`"));
    }
}
