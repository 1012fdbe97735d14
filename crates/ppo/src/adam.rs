//! Adam (Kingma & Ba, ICLR 2015, algorithm 1), on flat vectors.

use rayon::prelude::*;

const BETA1: f32 = 0.9;
const BETA2: f32 = 0.999;
const EPSILON: f32 = 1e-8;
/// Parameters a thread takes at a time.
const CHUNK: usize = 16_384;

/// The optimizer's memory.
#[derive(Clone, Debug)]
pub(crate) struct Adam {
    /// Mean of gradients.
    pub(crate) first_moment: Vec<f32>,
    /// Mean of squared gradients.
    pub(crate) second_moment: Vec<f32>,
    /// Steps taken.
    pub(crate) steps: u64,
}

impl Adam {
    pub(crate) fn new(parameters: usize) -> Self {
        Self { first_moment: vec![0.0; parameters], second_moment: vec![0.0; parameters], steps: 0 }
    }

    /// One step against `gradient`, multiplied by `scale` first.
    pub(crate) fn step(&mut self, parameters: &mut [f32], gradient: &[f32], scale: f32, learning_rate: f32) {
        self.steps += 1;
        let steps = self.steps.min(1 << 20) as i32;
        let correction1 = (1.0 - f64::from(BETA1).powi(steps)) as f32;
        let correction2 = (1.0 - f64::from(BETA2).powi(steps)) as f32;
        let rate = learning_rate / correction1;
        let inverse = 1.0 / correction2.sqrt();
        parameters
            .par_chunks_mut(CHUNK)
            .zip(gradient.par_chunks(CHUNK))
            .zip(self.first_moment.par_chunks_mut(CHUNK))
            .zip(self.second_moment.par_chunks_mut(CHUNK))
            .for_each(|(((parameters, gradient), first), second)| {
                for (((p, g), m), v) in parameters.iter_mut().zip(gradient).zip(first).zip(second) {
                    let g = g * scale;
                    *m = BETA1 * *m + (1.0 - BETA1) * g;
                    *v = BETA2 * *v + (1.0 - BETA2) * g * g;
                    *p -= rate * *m / (v.sqrt() * inverse + EPSILON);
                }
            });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_steps_by_hand() {
        let mut adam = Adam::new(1);
        let mut parameter = [1.0];
        adam.step(&mut parameter, &[0.5], 1.0, 0.1);
        // The first step has the length of the rate, whatever the gradient.
        assert!((parameter[0] - 0.9).abs() < 1e-6);
        adam.step(&mut parameter, &[-0.25], 2.0, 0.1);
        // m = .9·.05 − .1·.5 = −.005, v = .999·2.5e-4 + 1e-3·.25 = 4.9975e-4; corrected by .19 and .001999.
        let expected = 0.9 - 0.1 * (-0.005 / 0.19) / (4.9975e-4_f32 / 1.999e-3).sqrt();
        assert!((parameter[0] - expected).abs() < 1e-5, "{} {expected}", parameter[0]);
    }
}
