//! An environment that can be watched: the same to its learner, bit for bit.

use std::sync::Arc;
use std::time::{Duration, Instant};

use policy::{Mirror, StepBuffers, VecEnv};
use tasks::View;
use tasks::guidance::Behavior;

use super::window::{Ground, HEADER, Window};

/// Most robots that are shown together.
const SAMPLE: usize = 64;
/// They are within this of the first one when they are chosen \[m\]: the ground further away is not shown.
const NEAR_M: f32 = 12.0;
/// The same robots are shown for this long.
const SAMPLE_TIME: Duration = Duration::from_secs(20);

/// An environment, and the window it is seen through, if there is one.
#[derive(Debug)]
pub struct Watched<E> {
    env: E,
    window: Option<Arc<Window>>,
    sample: Option<Sample>,
    samples: u32,
}

/// The robots that are shown.
#[derive(Debug)]
struct Sample {
    robots: Vec<usize>,
    since: Instant,
    steps: u32,
}

impl<E: VecEnv + View> Watched<E> {
    /// Shows `env` through `window`, or to nobody.
    pub fn new(env: E, window: Option<Arc<Window>>) -> Self {
        Self { env, window, sample: None, samples: 0 }
    }

    /// Shows the robots as they are now, if anyone looks.
    fn show(&mut self) {
        let Some(window) = self.window.clone() else { return };
        if !window.is_watched() {
            self.sample = None;
            return;
        }
        let mut sample = match self.sample.take() {
            Some(sample) if sample.since.elapsed() < SAMPLE_TIME => sample,
            _ => self.take_sample(&window),
        };
        sample.steps += 1;
        window.show_frame(self.frame(&sample).into());
        self.sample = Some(sample);
    }

    /// The robots nearest to one, another each time, so that a page gets around.
    fn take_sample(&mut self, window: &Window) -> Sample {
        self.samples += 1;
        let count = self.env.num_envs();
        // Golden-section steps come near every robot before they come back to one.
        let focus = (f64::from(self.samples) * 0.618_033_988_75).fract() * count as f64;
        let focus = (focus as usize).min(count - 1);
        let mut view = Vec::new();
        let mut place = |robot: usize| {
            view.clear();
            self.env.write_view(robot, &mut view);
            [view[0], view[1]]
        };
        let [x, y] = place(focus);
        let mut by_distance: Vec<(f32, usize)> = (0..count)
            .map(|robot| {
                let [other_x, other_y] = place(robot);
                let distance = if robot == focus { -1.0 } else { (other_x - x).hypot(other_y - y) };
                (distance, robot)
            })
            .collect();
        by_distance.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        by_distance.retain(|(distance, _)| *distance <= NEAR_M);
        by_distance.truncate(SAMPLE);
        let ground = Ground { field: self.env.ground().clone(), sample: self.samples, place: [x, y] };
        window.show_ground(ground);
        let robots = by_distance.into_iter().map(|(_, robot)| robot).collect();
        Sample { robots, since: Instant::now(), steps: 0 }
    }

    /// A header of [`HEADER`] numbers and a row for each robot of the sample.
    fn frame(&self, sample: &Sample) -> Vec<f32> {
        let mut rows = Vec::new();
        for robot in &sample.robots {
            self.env.write_view(*robot, &mut rows);
        }
        let force_at = tasks::VIEW_FIELDS.iter().take_while(|(name, _)| *name != "observed_force");
        let force_at: usize = force_at.map(|(_, width)| width).sum();
        let force = [rows[force_at], rows[force_at + 1], rows[force_at + 2]];
        let mut frame = Vec::with_capacity(HEADER + rows.len());
        frame.extend([sample.steps as f32 * self.env.step_s(), sample.robots.len() as f32]);
        frame.extend(force);
        frame.push(Behavior::of_force(force) as usize as f32);
        frame.extend(rows);
        frame
    }
}

impl<E: VecEnv + View> VecEnv for Watched<E> {
    fn num_envs(&self) -> usize {
        self.env.num_envs()
    }

    fn observation_dim(&self) -> usize {
        self.env.observation_dim()
    }

    fn action_dim(&self) -> usize {
        self.env.action_dim()
    }

    fn observation_scale(&self) -> Vec<f32> {
        self.env.observation_scale()
    }

    fn mirror(&self) -> Option<Mirror> {
        self.env.mirror()
    }

    fn output_limits(&self) -> Option<(Vec<f32>, Vec<f32>)> {
        self.env.output_limits()
    }

    fn metadata(&self) -> Vec<(String, String)> {
        self.env.metadata()
    }

    fn reset(&mut self, observations: &mut [f32]) {
        self.env.reset(observations);
    }

    fn step(&mut self, actions: &[f32], out: &mut StepBuffers) {
        self.env.step(actions, out);
        self.show();
    }

    fn take_sums(&mut self) -> Vec<f64> {
        self.env.take_sums()
    }

    fn report(&mut self, sums: &[f64]) -> Vec<(String, f64)> {
        self.env.report(sums)
    }

    fn common_state_len(&self) -> usize {
        self.env.common_state_len()
    }

    fn save_state(&self, out: &mut Vec<u8>) {
        self.env.save_state(out);
    }

    fn load_state(&mut self, bytes: &[u8]) -> Result<(), String> {
        self.env.load_state(bytes)
    }
}

#[cfg(test)]
mod tests {
    use tasks::locomotion::{LocomotionConfig, LocomotionEnv};

    use super::*;
    use crate::watch::About;

    fn env() -> LocomotionEnv {
        LocomotionEnv::new(LocomotionConfig::default(), 96, 3).unwrap()
    }

    fn run(env: &mut impl VecEnv, steps: usize) -> (StepBuffers, Vec<(String, f64)>, Vec<u8>) {
        let mut buffers = StepBuffers::new(96, env.observation_dim());
        env.reset(&mut buffers.observations);
        for step in 0..steps {
            let actions: Vec<f32> = (0..96 * 12).map(|i| ((i + step) as f32).sin()).collect();
            env.step(&actions, &mut buffers);
        }
        let mut state = Vec::new();
        env.save_state(&mut state);
        (buffers, env.drain_metrics(), state)
    }

    #[test]
    fn a_learner_cannot_tell_whether_it_is_watched() {
        let window = Arc::new(Window::new(About::default()));
        let mut reader = window.reader();
        let (mut bare, mut watched) = (env(), Watched::new(env(), Some(window)));
        assert_eq!(bare.mirror(), watched.mirror());
        assert_eq!(bare.metadata(), watched.metadata());
        assert_eq!(bare.output_limits(), watched.output_limits());
        assert_eq!(bare.observation_scale(), watched.observation_scale());
        let (expected, found) = (run(&mut bare, 30), run(&mut watched, 30));
        assert!(expected.0.observations == found.0.observations && expected.0.rewards == found.0.rewards);
        assert!(expected.1 == found.1 && expected.2 == found.2);
        let news = reader.news(Duration::ZERO);
        assert_eq!(news.frames.len(), 30);
        assert!((news.frames[29][0] - 0.6).abs() < 1e-6);
    }

    #[test]
    fn the_robots_shown_are_those_around_the_place() {
        let window = Arc::new(Window::new(About::default()));
        let mut reader = window.reader();
        let mut watched = Watched::new(env(), Some(window));
        run(&mut watched, 1);
        let news = reader.news(Duration::ZERO);
        let [x, y] = news.ground.unwrap().place;
        let row: usize = tasks::VIEW_FIELDS.iter().map(|(_, width)| width).sum();
        let rows: Vec<&[f32]> = news.frames[0][HEADER..].chunks_exact(row).collect();
        assert!(rows.len() > 1 && rows.len() <= SAMPLE, "{} robots", rows.len());
        assert_eq!(rows.len() as f32, news.frames[0][1]);
        let distances: Vec<f32> = rows.iter().map(|row| (row[0] - x).hypot(row[1] - y)).collect();
        assert_eq!(distances[0], 0.0);
        assert!(distances.is_sorted() && distances.iter().all(|d| *d <= NEAR_M), "{distances:?}");
    }

    #[test]
    fn nothing_is_made_for_nobody() {
        let window = Arc::new(Window::new(About::default()));
        let mut watched = Watched::new(env(), Some(window.clone()));
        run(&mut watched, 3);
        let mut late = window.reader();
        assert!(late.news(Duration::ZERO).frames.is_empty() && watched.sample.is_none());
    }
}
