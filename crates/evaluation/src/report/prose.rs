//! What the report says in words: the summary, the criteria, how it was made.

use super::ReportData;
use super::markup::Element;
use super::number::{counted, fixed, percent};
use super::page::title;
use crate::results::{BehaviorReward, Group, Results};

/// What each behavior must do to succeed. The paper judges by eye and names no tolerance.
const CRITERIA: [(&str, &str); 4] = [
    (
        "walk",
        "mean forward speed within 0.8 ± 0.2 m/s, mean sideways speed at most 0.15 m/s, heading changed by at most 15°",
    ),
    (
        "stop",
        "mean planar speed at most 0.10 m/s, at most 0.30 m from where the window began, heading changed by at most 15°",
    ),
    (
        "turn",
        "mean forward speed at least 0.4 m/s, yaw rate of the right sign and within 25 % of its target (or within \
         0.15 rad/s, if that is more), course at most 20° off the heading",
    ),
    (
        "spin",
        "mean planar speed at most 0.15 m/s, never more than 0.5 m from where the window began, yaw rate as in turn",
    ),
];

/// Title, setting and summary.
pub(super) fn header(data: &ReportData) -> Element {
    let paragraph = |class: &str, text: String| Element::classed("p", class).text(text);
    Element::new("header")
        .child(Element::new("h1").text(title(data)))
        .child(paragraph("setting", setting(&data.judged)))
        .child(paragraph("lead", summary(&data.judged)))
}

/// Suite, ground, robot, what the supervisor saw, repetitions, policy and engine, as far as they are known.
fn setting(results: &Results) -> String {
    let named = |word: &str, name: &str| (!name.is_empty()).then(|| format!("{word} {name}"));
    let level = if results.level > 0 { format!(", level {}", results.level) } else { String::new() };
    let robot = if results.randomize { "a randomized robot" } else { "the nominal robot" };
    let repetitions = format!("{} a case", counted(results.episodes, "episode"));
    let parts = [
        named("Suite", &results.suite),
        named("ground", &results.ground).map(|ground| ground + &level),
        Some(robot.into()),
        results.friction.map(|friction| format!("friction {friction}")),
        results.unloaded.then(|| "pulls seen that do not act".into()),
        (results.force_noise_n > 0.0).then(|| format!("force seen with ±{} N", results.force_noise_n)),
        (results.sensor_noise > 0.0)
            .then(|| format!("other sensors' errors {} of training's", results.sensor_noise)),
        (results.episodes > 0).then_some(repetitions),
        Some(format!("seed {}", results.seed)),
        named("locomotion policy", &results.locomotion),
        named("in", results.engine.as_deref().unwrap_or_default()),
    ];
    parts.into_iter().flatten().collect::<Vec<_>>().join(" · ")
}

fn summary(results: &Results) -> String {
    let sentences = [Some(reward(results)), success(results), groups(results), falls(results)];
    sentences.into_iter().flatten().collect::<Vec<_>>().join(" ")
}

fn reward(results: &Results) -> String {
    let name = if results.supervisor.is_empty() { String::new() } else { format!(" {}", results.supervisor) };
    let (own, oracle) = (results.reward.total, results.oracle_reward.total);
    let compared = if oracle > 0.0 && results.supervisor != "oracle" {
        format!(", {} of the oracle’s {}", percent(own / oracle), fixed(oracle, 3))
    } else {
        String::new()
    };
    format!(
        "The supervisor{name} earns a behavior reward of {} of at most 1{compared}; the paper reports {} for its training.",
        fixed(own, 3),
        fixed(BehaviorReward::PAPER.total, 2)
    )
}

fn success(results: &Results) -> Option<String> {
    let worst = results.worst_case()?;
    let (episodes, successes) = (sum(results, |case| case.episodes), sum(results, |case| case.successes));
    let pulls = counted(results.cases.len(), "pull");
    if episodes > 0 && successes == episodes {
        return Some(format!("Under {pulls} it succeeds in all of {}.", counted(episodes, "episode")));
    }
    let rate = percent(successes as f64 / episodes as f64);
    let worst = format!("{} ({}) with {}", worst.name, worst.behavior, percent(worst.success_rate));
    Some(format!(
        "Under {pulls} it succeeds in {rate} of {}, at worst under {worst}.",
        counted(episodes, "episode")
    ))
}

fn groups(results: &Results) -> Option<String> {
    let rate = |group: Group| Some(format!("{} {}", group.name(), percent(results.group_success(group)?)));
    let rates: Vec<String> = Group::ALL.into_iter().filter_map(rate).collect();
    (rates.len() > 1).then(|| format!("Mean success by group: {}.", rates.join(", ")))
}

fn falls(results: &Results) -> Option<String> {
    let (episodes, falls) = (sum(results, |case| case.episodes), sum(results, |case| case.falls));
    match falls {
        _ if episodes == 0 => None,
        0 => Some("No episode ended in a fall.".into()),
        _ => Some(format!(
            "{} ({}) ended in a fall.",
            counted(falls, "episode"),
            percent(falls as f64 / episodes as f64)
        )),
    }
}

fn sum(results: &Results, count: impl Fn(&crate::results::CaseResult) -> usize) -> usize {
    results.cases.iter().map(count).fold(0, usize::saturating_add)
}

/// The criteria; `None` where nothing was judged.
pub(super) fn criteria(data: &ReportData) -> Option<Element> {
    if data.judged.cases.is_empty() {
        return None;
    }
    let text = "An episode is 2 to 2.5 s without force, then at least 12 s of pull. It is a success if the robot does \
                not fall and, from 2 s to 8 s after the pull has become what the case says, does what its behavior asks \
                (speeds are means of 0.5 s). Drift of the heading is taken from 2 s to 12 s. These tolerances are this \
                project’s; the paper judges by eye.";
    let list = description_list(CRITERIA.map(|(behavior, criterion)| (behavior, criterion)));
    Some(Element::classed("div", "criteria").child(Element::new("p").text(text)).child(list))
}

/// The notes; `None` without any.
pub(super) fn notes(data: &ReportData) -> Option<Element> {
    let notes = data.notes.iter().map(|(key, value)| (key.as_str(), value.as_str()));
    (!data.notes.is_empty()).then(|| description_list(notes))
}

fn description_list<'a>(entries: impl IntoIterator<Item = (&'a str, &'a str)>) -> Element {
    Element::new("dl").children(
        entries
            .into_iter()
            .flat_map(|(key, value)| [Element::new("dt").text(key), Element::new("dd").text(value)]),
    )
}
