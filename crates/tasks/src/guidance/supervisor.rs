//! Who turns forces into commands: the learned network, and the rules it is judged beside.

use policy::{ForwardWorkspace, Mlp, OnnxPolicy, layout};

use super::{
    Behavior,
    config::{COMMAND_HIGH, COMMAND_LOW, limited},
    walker::check_list,
};
use crate::simulation::{control_steps, is_whole_steps};

/// A learned supervisor: 226 inputs, a command as output; whatever its file says of limits, it is limited as in training.
#[derive(Clone, Debug, PartialEq)]
pub struct SupervisorPolicy {
    mlp: Mlp,
    period_s: f32,
}

impl SupervisorPolicy {
    /// Takes a policy read from a file.
    ///
    /// # Errors
    /// It is not for this observation, or has no period that control steps make up; the message names what was found and what is
    /// allowed.
    pub fn new(file: OnnxPolicy) -> Result<Self, String> {
        let shape = (file.mlp.inputs(), file.mlp.outputs());
        if shape != (layout::SUPERVISOR_OBSERVATION, layout::COMMAND) {
            return Err(format!(
                "a supervisor of {} inputs and {} outputs, must be {} and {}",
                shape.0,
                shape.1,
                layout::SUPERVISOR_OBSERVATION,
                layout::COMMAND
            ));
        }
        check_list(&file, "observation_names", &layout::SUPERVISOR.map(|segment| segment.name.to_owned()))?;
        let text = file.metadata.get("control_period").map(String::as_str).unwrap_or_default();
        let allowed = |period: &f32| (0.02..=1.0).contains(period) && is_whole_steps(*period);
        let period_s = text.parse().ok().filter(allowed);
        let period_s = period_s.ok_or_else(|| {
            format!("control_period is `{text}`, must be from 0.02 to 1 second, a multiple of 0.02")
        })?;
        Ok(Self { mlp: file.mlp, period_s })
    }

    /// A network at hand; its output is limited as the contract says.
    pub fn from_mlp(mut mlp: Mlp, period_s: f32) -> Self {
        mlp.output_limits = Some((COMMAND_LOW.to_vec(), COMMAND_HIGH.to_vec()));
        Self { mlp, period_s }
    }
}

/// Turns what is known of a robot into a velocity command.
#[derive(Clone, Debug, PartialEq)]
pub enum Supervisor {
    /// A trained network.
    Learned(SupervisorPolicy),
    /// Table II from the observed force.
    Rules,
    /// The same with thresholds that are higher by 2 N: as much as the hand trembles, or the sensor errs, where they are compared.
    RulesWithMargin,
    /// Table II from the force as scripted, at every control step: what commands alone can reach.
    Oracle,
    /// The rule of Morlando et al. (MED 2023), as coded in their repository: the larger component of the force decides; along
    /// the walk an admittance around a preferred pull of 30 N sets the speed, across it the robot turns on the spot.
    Dominance,
}

/// How much farther out thresholds with a margin lie, along x and y \[N\].
const RULE_MARGIN_N: [f32; 2] = [2.0; 2];
/// Time between two decisions of a rule \[s\]: the supervisor's in the paper.
const RULE_PERIOD_S: f32 = 0.1;

impl Supervisor {
    /// Control steps (0.02 s) from one decision to the next.
    pub fn period_steps(&self) -> u32 {
        let period_s = match self {
            Self::Learned(policy) => policy.period_s,
            Self::Oracle => return 1,
            Self::Rules | Self::RulesWithMargin | Self::Dominance => RULE_PERIOD_S,
        };
        control_steps(period_s)
    }

    /// Whether it looks at anything but the force.
    pub fn observes(&self) -> bool {
        matches!(self, Self::Learned(_))
    }

    /// Commands of a number of robots: `observations` robots × 226 (read only by [`Supervisor::Learned`]), and per robot
    /// the observed and the scripted force \[N\].
    pub fn decide(
        &self,
        observations: &[f32],
        forces: &[[[f32; 3]; 2]],
        workspace: &mut ForwardWorkspace,
        commands: &mut [[f32; 3]],
    ) {
        let rule: fn([[f32; 3]; 2]) -> [f32; 3] = match self {
            Self::Learned(policy) => {
                policy.mlp.forward(commands.len(), observations, commands.as_flattened_mut(), workspace);
                commands.iter_mut().for_each(|command| *command = limited(command));
                return;
            }
            Self::Rules => |[seen, _]| table_two(seen, [0.0; 2]),
            Self::RulesWithMargin => |[seen, _]| table_two(seen, RULE_MARGIN_N),
            Self::Oracle => |[_, real]| table_two(real, [0.0; 2]),
            Self::Dominance => |[seen, _]| dominance(seen),
        };
        commands.iter_mut().zip(forces).for_each(|(command, force)| *command = rule(*force));
    }
}

/// What Table II asks for under a force \[N\], with thresholds that are higher by `margin` \[N\].
fn table_two(force: [f32; 3], margin: [f32; 2]) -> [f32; 3] {
    Behavior::of_force_with_margin(force, margin).target(force)
}

/// One plan of the dominance rule. Figures: `prisma-lab/Tethering-human-with-quadruped`, as summarized with the derivation of
/// the static gain: a plan of 0.5 s goes 0.05 m + 4.8 mm/N · (30 N − |f_xy|); a lateral pull adds 0.07 rad a plan.
fn dominance(force: [f32; 3]) -> [f32; 3] {
    const PLAN_S: f32 = 0.5;
    const PREFERRED_PULL_N: f32 = 30.0;
    let [x, y, _] = force;
    if y.abs() > x.abs() {
        return [0.0, 0.0, 0.07 / PLAN_S * y.signum()];
    }
    let step = 0.05 + 0.0048 * (PREFERRED_PULL_N - x.hypot(y));
    [step / PLAN_S, 0.0, 0.0]
}

#[cfg(test)]
mod tests {
    use policy::{Activation, Linear};

    use super::*;

    fn decide(supervisor: &Supervisor, seen: [f32; 3], real: [f32; 3]) -> [f32; 3] {
        let mut commands = [[9.0; 3]];
        let observations = vec![0.0; layout::SUPERVISOR_OBSERVATION];
        supervisor.decide(&observations, &[[seen, real]], &mut ForwardWorkspace::default(), &mut commands);
        commands[0]
    }

    #[test]
    fn rules_read_the_observed_force_and_the_oracle_the_scripted_one() {
        let (seen, real) = ([-60.0, 25.0, 0.0], [0.0, -25.0, 0.0]);
        assert_eq!(decide(&Supervisor::Rules, seen, real), [0.0, 0.0, 0.5]);
        assert_eq!(decide(&Supervisor::Oracle, seen, real), [0.8, 0.0, -0.5]);
        assert_eq!((Supervisor::Oracle.period_steps(), Supervisor::Rules.period_steps()), (1, 5));
        let careful = |x, y| decide(&Supervisor::RulesWithMargin, [x, y, 0.0], real);
        assert_eq!([careful(-42.0, 22.0), careful(-42.1, 22.0)], [[0.8, 0.0, 0.0], [0.0; 3]]);
        assert_eq!(careful(-42.0, -22.5), [0.8, 0.0, -0.45]);
    }

    #[test]
    fn the_dominance_rule_at_its_published_points() {
        let speed = |x: f32| decide(&Supervisor::Dominance, [x, 0.0, 0.0], [0.0; 3])[0];
        // Nominal speeds: 0.39 m/s at 0 N, 0.10 at 30 N, 0 at 40.4 N, −0.12 at 53 N.
        for (pull, expected) in [(0.0, 0.39), (-30.0, 0.10), (-40.4, 0.0), (-53.0, -0.12)] {
            assert!((speed(pull) - expected).abs() < 0.005, "{pull}: {}", speed(pull));
        }
        let turning = decide(&Supervisor::Dominance, [-20.0, -30.0, 0.0], [0.0; 3]);
        assert_eq!(turning, [0.0, 0.0, -0.14]);
    }

    #[test]
    fn a_learned_command_is_limited_and_a_network_of_another_shape_refused() {
        let (inputs, outputs) = (layout::SUPERVISOR_OBSERVATION, layout::COMMAND);
        let layer =
            Linear { inputs, outputs, weight: vec![0.0; inputs * outputs], bias: vec![5.0, -5.0, 0.25] };
        let mlp = Mlp { layers: vec![layer], activation: Activation::Elu, output_limits: None };
        let command = |policy| decide(&Supervisor::Learned(policy), [0.0; 3], [0.0; 3]);
        assert_eq!(command(SupervisorPolicy::from_mlp(mlp.clone(), 0.1)), [1.2, -0.4, 0.25]);
        let file = OnnxPolicy { mlp, metadata: Default::default() };
        assert!(SupervisorPolicy::new(file.clone()).unwrap_err().contains("control_period is ``"));
        let metadata = |name: &str, text: &str| {
            let period = ("control_period".to_owned(), "0.1".to_owned());
            let metadata = [period, (name.to_owned(), text.to_owned())].into_iter().collect();
            SupervisorPolicy::new(OnnxPolicy { metadata, ..file.clone() })
        };
        // Its file has no limits; training would have had them all the same.
        assert_eq!(command(metadata("author", "nobody").unwrap()), [1.2, -0.4, 0.25]);
        let uneven = metadata("control_period", "0.05").unwrap_err();
        assert!(uneven.contains("is `0.05`") && uneven.contains("a multiple of 0.02"), "{uneven}");
        let other = metadata("observation_names", "harness_force,height_scan").unwrap_err();
        assert!(other.contains("is `harness_force,height_scan`, must be `base_linear_velocity,"), "{other}");
        let mut narrow = file;
        narrow.mlp.layers[0].inputs = 225;
        assert!(SupervisorPolicy::new(narrow).unwrap_err().contains("225 inputs"));
    }

    #[test]
    fn the_shipped_policies_are_accepted() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../policies");
        let file = |name: &str| policy::load_onnx(&folder.join(name)).unwrap();
        SupervisorPolicy::new(file("supervisor.onnx")).unwrap();
        crate::guidance::LocomotionPolicy::new(file("locomotion.onnx")).unwrap();
    }
}
