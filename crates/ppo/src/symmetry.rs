//! Networks that are symmetric: shown the left–right mirror image of a state, they give the mirror image of what they give for the
//! state. Hidden units come in pairs that swap what they say, the first with the last and so on, which makes every weight and bias equal
//! to another or to its negative; from symmetric weights, gradients averaged over such pairs lead to symmetric weights. A sample then
//! teaches its mirror image, too, with the same probability ratio, at no cost (van der Pol et al., *MDP homomorphic networks*, 2020,
//! section 4; for legged robots Su et al., *Leveraging symmetry in RL-based legged locomotion control*, 2024).

use policy::Mirror;

use crate::{config::SymmetryBy, gradient::Networks};

/// How a task's left–right symmetry is used, and what that takes.
#[derive(Clone, Debug)]
pub(crate) enum Symmetry {
    /// Not at all.
    None,
    /// Half of the samples are learned from in their mirror image.
    Samples(Mirror),
    /// The networks are symmetric.
    Networks(Images),
}

impl Symmetry {
    /// What using a task's mirror image this way takes.
    ///
    /// # Errors
    /// The task has none.
    pub(crate) fn new(by: SymmetryBy, mirror: Option<Mirror>, networks: &Networks) -> Result<Self, String> {
        let word = format!("{by:?}").to_lowercase();
        let without = || format!("symmetry is {word}, must be none: this task has no mirror image");
        let mirror = || mirror.ok_or_else(without);
        Ok(match by {
            SymmetryBy::None => Self::None,
            SymmetryBy::Samples => Self::Samples(mirror()?),
            SymmetryBy::Networks => Self::Networks(Images::new(networks, &mirror()?)),
        })
    }

    /// The mirror that half of the samples are seen in.
    pub(crate) fn of_samples(&self) -> Option<&Mirror> {
        if let Self::Samples(mirror) = self { Some(mirror) } else { None }
    }

    /// The mirror images of the networks' parameters.
    pub(crate) fn of_networks(&self) -> Option<&Images> {
        if let Self::Networks(images) = self { Some(images) } else { None }
    }
}

/// Where each parameter's mirror image is, and with what sign: an involution.
#[derive(Clone, Debug)]
pub(crate) struct Images {
    images: Vec<(usize, f32)>,
}

impl Images {
    pub(crate) fn new(networks: &Networks, mirror: &Mirror) -> Self {
        let mut images = Vec::with_capacity(networks.num_parameters());
        networks.actor.append_images(&mirror.observation, &mirror.action, &mut images);
        networks.critic.append_images(&mirror.observation, &[(0, 1.0)], &mut images);
        let log_std = images.len();
        images.extend(mirror.action.iter().map(|&(source, _)| (log_std + source, 1.0)));
        Self { images }
    }

    /// Makes parameters symmetric: of two images the first decides.
    pub(crate) fn impose(&self, parameters: &mut [f32]) {
        self.pair_up(parameters, |first, _| first);
    }

    /// Averages a gradient over images.
    pub(crate) fn average(&self, gradient: &mut [f32]) {
        self.pair_up(gradient, |first, second| 0.5 * (first + second));
    }

    /// Whether parameters are symmetric, to the bit.
    pub(crate) fn holds(&self, parameters: &[f32]) -> bool {
        parameters.iter().zip(&self.images).all(|(value, &(image, sign))| *value == sign * parameters[image])
    }

    /// Gives each pair of images one value, by that of the first and, its sign changed to the first's, of the second.
    fn pair_up(&self, values: &mut [f32], one: impl Fn(f32, f32) -> f32) {
        for (i, &(image, sign)) in self.images.iter().enumerate() {
            if image > i {
                let value = one(values[i], sign * values[image]);
                values[i] = value;
                values[image] = sign * value;
            } else if image == i && sign < 0.0 {
                values[i] = 0.0;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Config,
        network::{Architecture, store_rows},
        panels::{LANES, Precision, Single},
    };

    /// Two legs and something in the middle; an action for each leg, one for what turns.
    fn mirror() -> Mirror {
        Mirror {
            observation: vec![(1, -1.0), (0, -1.0), (2, 1.0), (3, -1.0)],
            action: vec![(1, 1.0), (0, 1.0), (2, -1.0)],
        }
    }

    fn networks() -> (Networks, Vec<f32>) {
        let networks = Networks {
            actor: Architecture::new(4, &[6, 5], 3),
            critic: Architecture::new(4, &[5], 1),
            actions: 3,
        };
        let parameters = networks.initial_parameters(1, &Config::default());
        (networks, parameters)
    }

    fn output(architecture: &Architecture, parameters: &[f32], input: &[f32]) -> Vec<f32> {
        let mut panels = Single::panels(LANES, input.len());
        store_rows::<Single>(input, input.len(), 1, &mut panels);
        let (mut packed, mut activations) = (architecture.packed(), architecture.activations(LANES));
        architecture.pack::<Single>(parameters, &mut packed);
        architecture.forward(&packed, 1, &panels, &mut activations);
        activations.output
    }

    #[test]
    fn a_mirrored_state_has_the_same_value_and_the_mirrored_action() {
        let (networks, mut parameters) = networks();
        let images = Images::new(&networks, &mirror());
        assert!(!images.holds(&parameters));
        images.impose(&mut parameters);
        assert!(images.holds(&parameters));
        let state = [0.3, -0.8, 0.5, 0.9];
        let mut mirrored = state;
        Mirror::apply(&mirror().observation, &state, &mut mirrored);
        let (actor, critic, _) = networks.split(&parameters);
        let [action, of_mirrored] = [&state, &mirrored].map(|state| output(&networks.actor, actor, state));
        let mut expected = [0.0; 3];
        Mirror::apply(&mirror().action, &action, &mut expected);
        assert!(expected.iter().zip(&of_mirrored).all(|(a, b)| (a - b).abs() < 1e-6));
        assert!((expected[0] - action[0]).abs() > 1e-3, "left and right differ");
        let [value, of_mirrored] =
            [&state, &mirrored].map(|state| output(&networks.critic, critic, state)[0]);
        assert!((value - of_mirrored).abs() < 1e-6);
    }

    #[test]
    fn a_task_without_a_mirror_image_can_only_do_without_symmetry() {
        let (networks, _) = networks();
        assert!(Symmetry::new(SymmetryBy::None, None, &networks).is_ok());
        let error = Symmetry::new(SymmetryBy::Samples, None, &networks).unwrap_err();
        assert_eq!(error, "symmetry is samples, must be none: this task has no mirror image");
    }

    #[test]
    fn averaged_gradients_keep_weights_symmetric() {
        let (networks, mut parameters) = networks();
        let images = Images::new(&networks, &mirror());
        images.impose(&mut parameters);
        let mut gradient: Vec<f32> = (0..parameters.len()).map(|i| (i as f32 * 0.7).sin()).collect();
        images.average(&mut gradient);
        let before = gradient.clone();
        images.average(&mut gradient);
        assert_eq!(before, gradient, "an average of averages");
        parameters.iter_mut().zip(&gradient).for_each(|(value, slope)| *value -= 0.01 * slope);
        assert!(images.holds(&parameters));
    }
}
