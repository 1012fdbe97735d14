//! A small report with one of everything, and ways to look into a page.

use std::f64::consts::FRAC_PI_2;

use evaluation::report::{Curve, PathTrace, ReportData, TrainingCurves};
use evaluation::results::{Behavior, BehaviorReward, CaseResult, Group, Results};
use roxmltree::{Document, Node, ParsingOptions};

pub(crate) fn case(name: &str, fy: f64, group: Group, behavior: Behavior, successes: usize) -> CaseResult {
    CaseResult {
        name: name.into(),
        fy,
        group,
        behavior,
        mean_vx: -0.25,
        ..CaseResult::from_counts(200, successes, 3)
    }
}

pub(crate) fn results(supervisor: &str, successes: [usize; 4]) -> Results {
    Results {
        suite: "paper17".into(),
        episodes: 200,
        supervisor: supervisor.into(),
        cases: vec![
            case("0/0", 0.0, Group::Trained, Behavior::Walk, successes[0]),
            case("-60/20", 20.0, Group::Edge, Behavior::Stop, successes[1]),
            case("0/50", 50.0, Group::Outside, Behavior::Turn, successes[2]),
            case("-60/-30", -30.0, Group::Trained, Behavior::Spin, successes[3]),
        ],
        reward: BehaviorReward { total: 0.912, stop: 0.24, walk: 0.23, turn: 0.21, spin: 0.232 },
        oracle_reward: BehaviorReward { total: 0.876, ..BehaviorReward::PAPER },
        ..Results::default()
    }
}

pub(crate) fn curve(points: impl IntoIterator<Item = f64>) -> Curve {
    Curve { name: "reward".into(), points: (1..).zip(points).collect() }
}

/// Straight ahead for 4 m, then a heading to the left.
pub(crate) fn trace(behavior: Behavior, case: &str) -> PathTrace {
    let points = (0..=40).map(|i| [0.1 * f64::from(i), 0.0, if i < 40 { 0.0 } else { FRAC_PI_2 }]).collect();
    PathTrace { behavior, case: case.into(), points, period_s: 0.1 }
}

pub(crate) fn full() -> ReportData {
    let rising = || curve((0..200).map(|i| f64::from(i) / 250.0));
    ReportData {
        title: "A report".into(),
        judged: results("supervisor.onnx", [200, 150, 100, 0]),
        baselines: vec![results("rules", [190, 80, 40, 20])],
        training: Some(TrainingCurves {
            total: rising(),
            behaviors: Behavior::ALL.map(|behavior| (behavior, rising())).to_vec(),
        }),
        traces: vec![trace(Behavior::Walk, "0/0"), trace(Behavior::Spin, "-60/-30")],
        notes: vec![("Seed".into(), "17".into())],
    }
}

/// Parses a page or a figure; panics where it is not well formed.
pub(crate) fn parse(text: &str) -> Document<'_> {
    let options = ParsingOptions { allow_dtd: true, ..ParsingOptions::default() };
    Document::parse_with_options(text, options).unwrap_or_else(|error| panic!("{error}"))
}

pub(crate) fn named<'a>(root: Node<'a, 'a>, name: &'static str) -> impl Iterator<Item = Node<'a, 'a>> {
    root.descendants().filter(move |node| node.tag_name().name() == name)
}

/// Elements of which `class` is one class.
pub(crate) fn classed<'a>(root: Node<'a, 'a>, class: &'static str) -> impl Iterator<Item = Node<'a, 'a>> {
    root.descendants()
        .filter(move |node| node.attribute("class").is_some_and(|all| all.split(' ').any(|one| one == class)))
}

pub(crate) fn number(node: Node<'_, '_>, attribute: &str) -> f64 {
    let text = node.attribute(attribute).unwrap_or_else(|| panic!("{node:?} has no {attribute}"));
    text.parse().unwrap_or_else(|_| panic!("{attribute}=\"{text}\""))
}

/// All text of an element.
pub(crate) fn text(node: Node<'_, '_>) -> String {
    node.descendants().filter(Node::is_text).filter_map(|node| node.text()).collect()
}
