//! Every number and picture of docs/results.md about the shipped policies, in parts that are kept once they are made.

mod ablations;
mod baselines;
mod pair;
mod swaps;

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context as _, Result, anyhow};
use clap::ValueEnum as _;
use evaluation::film::{FRAME_STEPS, film};
use evaluation::judge::{Arena, Ground, Setting};
use evaluation::locomotion::{LocomotionResults, judge_locomotion};
use evaluation::report::{intent_map_svg, paths_svg, series_svg, success_bars_svg};
use evaluation::results::{Results, VERSION};
use evaluation::suite::{Case, episodes, suite, tiles};

use crate::interrupt::Interrupt;
use crate::judging::{LEVEL, Names, judge, judge_record, with_progress, write_plan};
use crate::policies::{self, SHIPPED};
use crate::result_tables::{side_by_side, table};
use crate::run_folder::write_atomic;

/// Episodes of a case in the other engine, which is slower. On level ground they are hardly more than one (docs/engines.md).
const OTHER_ENGINE: [(Ground, usize); 3] = [(Ground::Flat, 20), (Ground::Rough, 100), (Ground::Stairs, 100)];
/// Control steps of a figure over time: 10 s.
const SERIES_STEPS: usize = 500;

/// The robots of a judgment.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Robots {
    Nominal,
    Randomized,
    /// Randomized, but all with this friction \[1\].
    Slippery(f64),
    /// All sensors but that of the force err as in training; randomized, if so.
    Noisy(bool),
    /// Nominal, and the pulls that are seen do not act.
    Unloaded,
}

/// One judgment: suite, ground, robots, supervisor.
type Part = (&'static str, Ground, Robots, &'static str);

/// All judgments, in the order of what a reader wants first.
const PARTS: [Part; 30] = {
    use Ground::{Flat, Rough, Stairs};
    use Robots::{Noisy, Nominal, Randomized, Slippery, Unloaded};
    [
        ("paper17", Flat, Nominal, SHIPPED),
        ("mirror17", Flat, Nominal, SHIPPED),
        ("paper17", Flat, Nominal, "oracle"),
        ("paper17", Flat, Unloaded, "oracle"),
        ("paper17", Flat, Nominal, "rules"),
        ("paper17", Flat, Nominal, "dominance"),
        ("paper17", Flat, Randomized, SHIPPED),
        ("mirror17", Flat, Randomized, SHIPPED),
        ("paper17", Flat, Noisy(true), SHIPPED),
        ("paper17", Flat, Slippery(0.6), SHIPPED),
        ("paper17", Flat, Slippery(0.4), SHIPPED),
        ("paper17", Flat, Slippery(0.3), SHIPPED),
        ("paper17", Flat, Slippery(0.2), SHIPPED),
        ("paper17", Rough, Nominal, SHIPPED),
        ("paper17", Rough, Nominal, "oracle"),
        ("paper17", Rough, Noisy(false), SHIPPED),
        ("paper17", Stairs, Nominal, SHIPPED),
        ("edges", Flat, Nominal, SHIPPED),
        ("edges", Flat, Nominal, "rules"),
        ("edges", Flat, Randomized, SHIPPED),
        ("edges", Flat, Noisy(true), SHIPPED),
        ("edges", Rough, Nominal, SHIPPED),
        ("dynamic", Flat, Nominal, SHIPPED),
        ("dynamic", Flat, Nominal, "rules"),
        ("dynamic", Flat, Randomized, SHIPPED),
        ("dynamic", Rough, Nominal, SHIPPED),
        ("plane", Flat, Nominal, SHIPPED),
        ("plane", Flat, Randomized, SHIPPED),
        ("plane", Flat, Nominal, "rules"),
        ("plane", Rough, Nominal, SHIPPED),
    ]
};

/// One film a behavior: name and pull.
const FILMS: [(&str, [f32; 2]); 4] =
    [("walk", [0.0, 0.0]), ("stop", [-60.0, 0.0]), ("turn", [0.0, 30.0]), ("spin", [-60.0, 30.0])];
/// Cases of the suite `dynamic` that are drawn over time.
const SERIES: [(&str, &str); 2] = [("tug", "tug 0/60, 0.5 s"), ("change-of-mind", "0/30, then 0/-30")];

/// What everything consists of, in the order in which it is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Section {
    /// Every suite on every ground
    Judgments,
    /// The walking by itself
    Locomotion,
    /// Films, and figures over time
    Pictures,
    /// The shipped pair in MuJoCo
    Mujoco,
    /// Supervisors trained with one thing changed
    Ablations,
    /// Rules and learned supervisors with an imprecise force sensor
    Baselines,
    /// The shipped policies paired with others
    Swaps,
}

/// Makes what is missing in `folder`, all of it or one section; false if the user interrupts.
///
/// # Errors
/// The disk refuses, or a policy cannot be used.
pub fn make(
    folder: &Path,
    only: Option<Section>,
    episodes: usize,
    seed: u64,
    interrupt: &Interrupt,
) -> Result<bool> {
    // Parts of other policies must not be taken for these ones'.
    let folder = folder.join(format!("everything-{:08x}", policies::shipped_checksum()));
    std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    let maker = Maker { folder, episodes, seed };
    for section in Section::value_variants() {
        if only.is_none_or(|only| only == *section) && !maker.section(*section, interrupt)? {
            return Ok(false);
        }
    }
    crate::say!("everything: {}", maker.folder.display());
    Ok(true)
}

struct Maker {
    folder: PathBuf,
    episodes: usize,
    seed: u64,
}

impl Maker {
    fn file(&self, name: &str, extension: &str) -> PathBuf {
        self.folder.join(format!("{name}.{extension}"))
    }

    fn write(&self, name: &str, extension: &str, bytes: &[u8]) -> Result<()> {
        let path = self.file(name, extension);
        write_atomic(&path, bytes).with_context(|| path.display().to_string())
    }

    /// False if the user interrupts.
    fn section(&self, section: Section, interrupt: &Interrupt) -> Result<bool> {
        match section {
            Section::Judgments => self.one_by_one(&PARTS, interrupt, Self::judgment),
            Section::Locomotion => self.locomotion().map(|()| !interrupt.requested()),
            Section::Pictures => self.pictures().map(|()| !interrupt.requested()),
            Section::Mujoco => {
                self.one_by_one(&OTHER_ENGINE, interrupt, |maker, part| maker.other_engine(part, interrupt))
            }
            Section::Ablations => self.ablations(interrupt),
            Section::Baselines => self.baselines(interrupt),
            Section::Swaps => self.swaps(interrupt),
        }
    }

    /// Makes one part after the other; false if the user interrupts.
    fn one_by_one<T: Copy>(
        &self,
        parts: &[T],
        interrupt: &Interrupt,
        make: impl Fn(&Self, T) -> Result<()>,
    ) -> Result<bool> {
        for part in parts {
            if interrupt.requested() {
                return Ok(false);
            }
            make(self, *part)?;
        }
        Ok(!interrupt.requested())
    }

    fn arena(&self, ground: Ground, robots: Robots, episodes: usize, tiles: Option<usize>) -> Result<Arena> {
        let level = ground.level(LEVEL);
        let setting = Setting {
            ground,
            level,
            randomize: matches!(robots, Robots::Randomized | Robots::Slippery(_) | Robots::Noisy(true)),
            sensor_noise: if matches!(robots, Robots::Noisy(_)) { 1.0 } else { 0.0 },
            friction: if let Robots::Slippery(friction) = robots { Some(friction) } else { None },
            unloaded: robots == Robots::Unloaded,
            episodes,
            tiles,
            seed: self.seed,
            ..Setting::default()
        };
        Arena::new(policies::locomotion(SHIPPED)?, setting).map_err(anyhow::Error::msg)
    }

    /// What a part has found, if it was finished with the same measures, episodes and seed.
    fn finished(&self, name: &str, episodes: usize) -> Option<Results> {
        let results = Results::read(&self.file(name, "json")).ok()?;
        let found = (results.version, results.episodes, results.seed);
        (found == (VERSION, episodes, self.seed)).then_some(results)
    }

    fn judgment(&self, (suite_name, ground, robots, supervisor): Part) -> Result<()> {
        let name = part_name((suite_name, ground, robots, supervisor));
        let count = episodes(suite_name, self.episodes);
        if self.finished(&name, count).is_some() {
            crate::tell!("{name}: made before");
            return Ok(());
        }
        crate::tell!("{name}");
        let arena = self.arena(ground, robots, count, tiles(suite_name))?;
        let cases = suite(suite_name).context("a suite of the list")?;
        let names = Names::new(suite_name, SHIPPED, supervisor)?;
        // The oracle's reward is the same for all that are judged on a ground, which has as many tiles as a case has episodes,
        // or as the suite says.
        let place = |part: &Part| (part.1, part.2, episodes(part.0, self.episodes), tiles(part.0));
        let here = (ground, robots, count, tiles(suite_name));
        let oracle = PARTS
            .iter()
            .filter(|part| place(part) == here)
            .find_map(|part| Some(self.finished(&part_name(*part), count)?.oracle_reward));
        let (results, _) = judge(&arena, &policies::supervisor(supervisor)?, &cases, &names, oracle)?;
        self.keep(&name, &results)
    }

    /// The numbers come last: they say that a part is finished.
    fn keep(&self, name: &str, results: &Results) -> Result<()> {
        let figure = intent_map_svg(results).unwrap_or_else(|| success_bars_svg(results, &[]));
        self.write(name, "svg", figure.as_bytes())?;
        self.write(name, "txt", table(results).as_bytes())?;
        results.write(&self.file(name, "json")).with_context(|| name.to_owned())
    }

    /// As [`Self::finished`], of the walking by itself.
    fn locomotion_is_finished(&self) -> bool {
        let found = std::fs::read(self.file("locomotion", "json")).ok();
        let found = found.and_then(|text| serde_json::from_slice::<LocomotionResults>(&text).ok());
        let known = (VERSION, self.episodes, self.seed);
        found.is_some_and(|found| (found.version, found.episodes, found.seed) == known)
    }

    fn locomotion(&self) -> Result<()> {
        if self.locomotion_is_finished() {
            crate::tell!("locomotion: made before");
            return Ok(());
        }
        let policy = policies::locomotion(SHIPPED)?;
        let results = with_progress("judging locomotion: row", |progress| {
            judge_locomotion(&policy, SHIPPED, self.episodes, self.seed, progress)
        })
        .map_err(anyhow::Error::msg)?;
        self.write("locomotion", "txt", results.tables().as_bytes())?;
        self.write("locomotion", "json", (serde_json::to_string_pretty(&results)? + "\n").as_bytes())
    }

    fn pictures(&self) -> Result<()> {
        let arena = self.arena(Ground::Flat, Robots::Nominal, 1, None)?;
        let supervisor = policies::supervisor(SHIPPED)?;
        for (name, [fx, fy]) in FILMS {
            let mut poses = arena.poses(&supervisor, &Case::steady(fx, fy)).map_err(anyhow::Error::msg)?;
            poses.truncate(6 * 50 / FRAME_STEPS);
            let picture = film(&poses, arena.ground()).map_err(anyhow::Error::msg)?;
            self.write(name, "gif", &picture)?;
        }
        let cases = suite("paper17").context("the suite paper17")?;
        let (cases, traces) = arena.judge(&supervisor, &cases, &|_| {}).map_err(anyhow::Error::msg)?;
        let paths = paths_svg(&cases, &traces).context("no path can be drawn")?;
        self.write("paths", "svg", paths.as_bytes())?;
        for (name, case) in SERIES {
            let cases = suite("dynamic").unwrap_or_default();
            let case = cases.into_iter().find(|c| c.name == case).with_context(|| case.to_owned())?;
            let mut recording = arena.record(&supervisor, &case).map_err(anyhow::Error::msg)?;
            recording.samples.truncate(SERIES_STEPS);
            self.write(name, "svg", series_svg(&case.name, &recording).as_bytes())?;
        }
        Ok(())
    }

    /// `paper17` in MuJoCo, beside the same episodes here; skipped, with the reason, where there is no MuJoCo.
    fn other_engine(&self, (ground, episodes): (Ground, usize), interrupt: &Interrupt) -> Result<()> {
        let name = format!("mujoco-paper17-{}", ground.name());
        if self.finished(&name, episodes).is_some() {
            crate::tell!("{name}: made before");
            return Ok(());
        }
        let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".into());
        let script = Path::new("scripts/reference/play_in_mujoco.py");
        let has_packages = Command::new(&python)
            .args(["-c", "import mujoco, numpy, onnxruntime"])
            .output()
            .is_ok_and(|output| output.status.success());
        if !script.is_file() || !has_packages {
            crate::tell!(
                "{name}: skipped; it needs {} and a Python (PYTHON) with mujoco, numpy and onnxruntime",
                script.display()
            );
            return Ok(());
        }
        crate::tell!("{name}");
        let arena = self.arena(ground, Robots::Nominal, episodes, None)?;
        let cases = suite("paper17").context("the suite paper17")?;
        let [plan, record] = ["plan", "record"].map(|extension| self.file(&name, extension));
        // Those inside the program: the folder's are another pair where the program is of another day.
        let policies = [("locomotion", policies::LOCOMOTION), ("supervisor", policies::SUPERVISOR)];
        let mut command = Command::new(&python);
        command.arg(script).args([&plan, &record]);
        for (policy, bytes) in policies {
            self.write(policy, "onnx", bytes)?;
            command.arg(format!("--{policy}")).arg(self.file(policy, "onnx"));
        }
        write_plan(&arena, &cases, "paper17", &plan)?;
        let status = command.status()?;
        // Ctrl-C reaches Python, too.
        if interrupt.requested() {
            return Ok(());
        }
        if !status.success() {
            return Err(anyhow!("{}: {status}", script.display()));
        }
        let (other, _) = judge_record(&record)?;
        let names = Names::new("paper17", SHIPPED, SHIPPED)?;
        let (own, _) = judge(&arena, &policies::supervisor(SHIPPED)?, &cases, &names, None)?;
        for file in [&plan, &record] {
            std::fs::remove_file(file)?;
        }
        self.write(&format!("{name}-beside"), "txt", side_by_side(&own, &other).as_bytes())?;
        self.keep(&name, &other)
    }
}

fn part_name((suite, ground, robots, supervisor): Part) -> String {
    let robots = match robots {
        Robots::Nominal => String::new(),
        Robots::Randomized => "-randomized".into(),
        Robots::Slippery(friction) => format!("-friction-{friction}"),
        Robots::Noisy(randomized) => if randomized { "-randomized-noisy" } else { "-noisy" }.into(),
        Robots::Unloaded => "-unloaded".into(),
    };
    format!("{suite}-{}{robots}-{supervisor}", ground.name())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_part_has_a_name_of_its_own_and_a_suite_and_supervisor_that_exist() {
        let mut names: Vec<String> = PARTS.iter().map(|part| part_name(*part)).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), PARTS.len());
        for (name, _, _, supervisor) in PARTS {
            assert!(suite(name).is_some() && policies::supervisor(supervisor).is_ok());
        }
        let dynamic = suite("dynamic").unwrap();
        assert!(SERIES.iter().all(|(_, name)| dynamic.iter().any(|case| case.name == *name)));
    }

    #[test]
    fn a_finished_part_is_known_by_its_measures_episodes_and_seed() {
        let folder = tempfile::tempdir().unwrap();
        let maker = Maker { folder: folder.path().to_owned(), episodes: 20, seed: 3 };
        assert_eq!(maker.finished("part", 20), None);
        let results = Results { version: VERSION, episodes: 20, seed: 3, ..Results::default() };
        maker.keep("part", &results).unwrap();
        assert_eq!(maker.finished("part", 20), Some(results.clone()));
        assert_eq!(maker.finished("part", 21), None);
        maker.keep("part", &Results { version: VERSION - 1, ..results }).unwrap();
        assert_eq!(maker.finished("part", 20), None);
        for (seed, is_finished) in [(2, false), (3, true)] {
            let results = LocomotionResults { version: VERSION, episodes: 20, seed, ..Default::default() };
            maker.write("locomotion", "json", &serde_json::to_vec(&results).unwrap()).unwrap();
            assert_eq!(maker.locomotion_is_finished(), is_finished);
        }
    }
}
