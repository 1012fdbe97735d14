//! What a training shows, between the thread that trains and those that serve pages.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use tasks::VIEW_FIELDS;
use terrain::HeightField;

use super::Curves;

/// Frames kept for pages that lag behind.
const MAX_FRAMES: usize = 64;
/// Numbers before the robots' rows in a frame: time since the sample was taken \[s\], robots, force on the hand of the first \[N\]
/// ×3, Table II's label of it.
pub(super) const HEADER: usize = 6;

/// What does not change while a training runs.
#[derive(Clone, Debug, Default)]
pub struct About {
    /// Name of the run.
    pub run: String,
    /// What is trained: `locomotion` or `supervisor`.
    pub task: String,
    /// Robots in training.
    pub robots: usize,
    /// Iterations in all.
    pub iterations: u64,
    /// Metrics worth drawing first.
    pub shown: Vec<String>,
}

/// The ground, and the place on it that is looked at.
#[derive(Clone, Debug)]
pub struct Ground {
    /// All of it.
    pub field: Arc<HeightField>,
    /// Number of the sample of robots that are there.
    pub sample: u32,
    /// Place of the sample's first robot when it was taken \[m\].
    pub place: [f32; 2],
}

/// Frames and curves of a training, put in by it and taken out by any number of readers. Nobody who puts in waits for a reader.
#[derive(Debug)]
pub struct Window {
    about: About,
    state: Mutex<State>,
    changed: Condvar,
    readers: AtomicUsize,
}

#[derive(Debug, Default)]
struct State {
    frames: VecDeque<Arc<[f32]>>,
    /// Number of the oldest frame in `frames`.
    first_frame: u64,
    ground: Option<Ground>,
    curves: Curves,
    ended: Option<&'static str>,
}

/// How far a reader is; counts as one while it lives.
#[derive(Debug)]
pub struct Cursor {
    window: Arc<Window>,
    frame: u64,
    sample: Option<u32>,
    curves: (u64, usize),
    told_end: bool,
}

/// What is new to a reader.
#[derive(Clone, Debug, Default)]
pub struct News {
    /// The ground of another sample.
    pub ground: Option<Ground>,
    /// Frames, the oldest first. Those a reader was too slow for are missing.
    pub frames: Vec<Arc<[f32]>>,
    /// Curves, as a message to the page.
    pub curves: Option<String>,
    /// How the training ended, told once.
    pub ended: Option<&'static str>,
}

impl Window {
    /// Nothing to see yet.
    pub fn new(about: About) -> Self {
        Self { about, state: Mutex::default(), changed: Condvar::new(), readers: AtomicUsize::new(0) }
    }

    /// The first message to a page.
    pub fn hello(&self) -> String {
        let About { run, task, robots, iterations, shown } = &self.about;
        let mut fields = serde_json::Map::new();
        let mut row = 0;
        for (name, width) in VIEW_FIELDS {
            fields.insert(name.into(), row.into());
            row += width;
        }
        serde_json::json!({
            "kind": "hello", "run": run, "task": task, "robots": robots, "iterations": iterations, "shown": shown,
            "frame": { "header": HEADER, "row": row, "fields": fields },
        })
        .to_string()
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // Nothing in here is left half-done by a panic.
        self.state.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    /// Whether anyone looks.
    pub fn is_watched(&self) -> bool {
        self.readers.load(Ordering::Relaxed) > 0
    }

    /// Readers at present.
    pub fn readers(&self) -> usize {
        self.readers.load(Ordering::Relaxed)
    }

    /// Shows another place.
    pub fn show_ground(&self, ground: Ground) {
        let mut state = self.state();
        // What is left of the sample before would be drawn on this ground.
        state.first_frame += state.frames.len() as u64;
        state.frames.clear();
        state.ground = Some(ground);
    }

    /// Shows a moment; the oldest one makes room for it.
    pub fn show_frame(&self, frame: Arc<[f32]>) {
        let mut state = self.state();
        if state.frames.len() == MAX_FRAMES {
            state.frames.pop_front();
            state.first_frame += 1;
        }
        state.frames.push_back(frame);
        drop(state);
        self.changed.notify_all();
    }

    /// Shows the numbers of an iteration.
    pub fn show_row(&self, iteration: u64, values: &[(String, f64)]) {
        self.state().curves.append(iteration, values);
        self.changed.notify_all();
    }

    /// Tells all readers how the training ended, and gives them `patience` to pass it on.
    pub fn end(&self, how: &'static str, patience: Duration) {
        self.state().ended = Some(how);
        self.changed.notify_all();
        let began = Instant::now();
        while self.is_watched() && began.elapsed() < patience {
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    /// A reader that begins with the present.
    pub fn reader(self: &Arc<Self>) -> Cursor {
        self.readers.fetch_add(1, Ordering::Relaxed);
        let frame = {
            let state = self.state();
            state.first_frame + state.frames.len() as u64
        };
        Cursor { window: self.clone(), frame, sample: None, curves: (0, 0), told_end: false }
    }
}

impl Cursor {
    /// What came since the last call; waits up to `patience` where there is nothing.
    pub fn news(&mut self, patience: Duration) -> News {
        let window = self.window.clone();
        let news = self.take(&window.state());
        if !news.is_empty() {
            return news;
        }
        let waited = window.changed.wait_timeout(window.state(), patience);
        let (state, _) = waited.unwrap_or_else(std::sync::PoisonError::into_inner);
        self.take(&state)
    }

    fn take(&mut self, state: &State) -> News {
        let newest = state.first_frame + state.frames.len() as u64;
        let ground = state.ground.as_ref().filter(|ground| self.sample != Some(ground.sample)).cloned();
        // A page sees nothing without its ground, and that of a sample long gone is of no use.
        let ground = ground.filter(|_| !state.frames.is_empty());
        if let Some(ground) = &ground {
            self.sample = Some(ground.sample);
        }
        let seen = self.frame.saturating_sub(state.first_frame) as usize;
        let frames = state.frames.iter().skip(seen).cloned().collect();
        self.frame = newest;
        let curves = state.curves.news(&mut self.curves);
        let ended = state.ended.filter(|_| !std::mem::replace(&mut self.told_end, state.ended.is_some()));
        News { ground, frames, curves, ended }
    }
}

impl Drop for Cursor {
    fn drop(&mut self) {
        self.window.readers.fetch_sub(1, Ordering::Relaxed);
    }
}

impl News {
    fn is_empty(&self) -> bool {
        self.ground.is_none() && self.frames.is_empty() && self.curves.is_none() && self.ended.is_none()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOW: Duration = Duration::ZERO;

    fn frame(number: f32) -> Arc<[f32]> {
        Arc::from([number])
    }

    fn numbers(news: &News) -> Vec<f32> {
        news.frames.iter().map(|frame| frame[0]).collect()
    }

    #[test]
    fn a_slow_reader_misses_frames_and_no_more_are_kept() {
        let window = Arc::new(Window::new(About::default()));
        let (mut quick, mut slow) = (window.reader(), window.reader());
        for number in 0..1000 {
            window.show_frame(frame(number as f32));
            assert_eq!(numbers(&quick.news(NOW)), [number as f32]);
        }
        let last: Vec<f32> = (1000 - MAX_FRAMES..1000).map(|number| number as f32).collect();
        assert_eq!(numbers(&slow.news(NOW)), last);
        assert!(slow.news(NOW).is_empty());
    }

    #[test]
    fn another_sample_comes_with_its_ground_and_without_old_frames() {
        let window = Arc::new(Window::new(About::default()));
        let mut reader = window.reader();
        let ground = |sample| Ground { field: Arc::new(HeightField::flat(0.0)), sample, place: [0.0; 2] };
        window.show_ground(ground(1));
        window.show_frame(frame(1.0));
        assert_eq!(reader.news(NOW).ground.unwrap().sample, 1);
        window.show_frame(frame(2.0));
        window.show_ground(ground(2));
        window.show_frame(frame(3.0));
        let news = reader.news(NOW);
        assert_eq!((news.ground.as_ref().unwrap().sample, numbers(&news)), (2, vec![3.0]));
    }

    #[test]
    fn the_end_is_told_once_and_not_waited_for_for_long() {
        let window = Arc::new(Window::new(About::default()));
        assert!(!window.is_watched());
        let mut reader = window.reader();
        let began = Instant::now();
        window.end("finished", Duration::from_millis(50));
        assert!(began.elapsed() >= Duration::from_millis(50) && began.elapsed() < Duration::from_secs(5));
        assert_eq!(reader.news(NOW).ended, Some("finished"));
        assert_eq!(reader.news(NOW).ended, None);
        drop(reader);
        assert!(!window.is_watched());
    }
}
