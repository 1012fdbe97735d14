//! Robots under random actions, pushes and extreme randomization; reports what is not sound and how fast things got:
//! `cargo run --release -p guidedog-tasks --example soak [robots] [control steps]`.

use spatial::{Philox, Purpose};
use tasks::simulation::{GROUP, Randomization, ResetSpread, Simulation};
use terrain::{GridConfig, TerrainGrid};

fn main() {
    let mut arguments = std::env::args().skip(1).map(|text| text.parse::<usize>().expect("a number"));
    let robots = arguments.next().unwrap_or(512);
    let steps = arguments.next().unwrap_or(1000);
    let flat = std::env::var("FLAT").is_ok();
    let grid =
        if flat { TerrainGrid::flat() } else { TerrainGrid::new(&GridConfig::default()).expect("terrain") };
    let simulation = Simulation::new(grid.field.clone(), physics::Config::default());
    let mut groups = simulation.groups(robots, &Randomization::default(), 1).expect("a multiple of sixteen");
    let (mut broken, mut fast, mut resets) = (0, 0, 0);
    let mut fastest = 0.0_f64;
    for (g, group) in groups.iter_mut().enumerate() {
        for lane in 0..GROUP {
            let mut random = Philox::new(1, g * GROUP + lane, 0, 0, Purpose::Reset);
            let spawn = grid.spawn(random.below(grid.levels() as u32) as usize, g % grid.columns());
            simulation.reset(group, lane, spawn, &ResetSpread::default(), &mut random);
        }
        for step in 0..steps {
            let mut random = Philox::new(2, g, step as u32, 0, Purpose::Action);
            let actions: Vec<f32> = (0..GROUP * 12).map(|_| 1.0 * random.normal()).collect();
            let before = group.clone();
            simulation.control_step(group, &actions);
            for lane in 0..GROUP {
                let rate = |group: &tasks::simulation::Group| {
                    let joints =
                        group.block.state.joint_velocity.iter().map(|q| f64::from(q.as_array()[lane]).abs());
                    joints.fold(0.0, f64::max)
                };
                let now = rate(group);
                fastest = fastest.max(now);
                if now > 60.0 && fast < 5 {
                    fast += 1;
                    println!("group {g} lane {lane} step {step}: {} -> {now}", rate(&before));
                    let mut again = before.clone();
                    for j in 0..12 {
                        again.block.input.joint_target[j] = group.block.input.joint_target[j];
                    }
                    for sub in 0..4 {
                        let s = &again.block.state;
                        println!(
                            "  sub {sub}: base v {:?} w {:?} z {:.3}",
                            s.base_linear_velocity.get(lane),
                            s.base_angular_velocity.get(lane),
                            s.base_position.get(lane)[2]
                        );
                        println!(
                            "    q {:?}",
                            s.joint_position
                                .iter()
                                .map(|q| (q.as_array()[lane] * 100.0).round() / 100.0)
                                .collect::<Vec<_>>()
                        );
                        println!(
                            "    qd {:?}",
                            s.joint_velocity
                                .iter()
                                .map(|q| (q.as_array()[lane] * 10.0).round() / 10.0)
                                .collect::<Vec<_>>()
                        );
                        again.block.step(&simulation.engine);
                        for (i, f) in again.block.output.contact_force.iter().enumerate() {
                            let f = f.get(lane);
                            if f != [0.0; 3] {
                                println!("    contact {} {:?}", simulation.robot().contacts[i].name, f);
                            }
                        }
                        println!(
                            "    tau {:?}",
                            again
                                .block
                                .output
                                .joint_torque
                                .iter()
                                .map(|q| q.as_array()[lane].round())
                                .collect::<Vec<_>>()
                        );
                    }
                }
                if !group.is_sound(lane) {
                    broken += 1;
                }
                if !group.is_sound(lane) || group.has_fallen(lane) {
                    resets += 1;
                    let mut random = Philox::new(1, g * GROUP + lane, step as u32 + 1, 0, Purpose::Reset);
                    let spawn = grid.spawn(random.below(grid.levels() as u32) as usize, g % grid.columns());
                    simulation.reset(group, lane, spawn, &ResetSpread::default(), &mut random);
                }
            }
        }
    }
    println!(
        "{} robot-steps: {broken} broken, {resets} resets, fastest joint {fastest:.1} rad/s",
        robots * steps * 4
    );
}
