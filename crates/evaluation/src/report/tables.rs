//! The two tables: behavior rewards, and every case with its measures.

use super::ReportData;
use super::markup::{Element, shortened};
use super::number::{fixed, percentage};
use crate::results::{Behavior, BehaviorReward, CaseResult, Results};

/// The order in which the paper speaks of its behaviors.
const PAPER_ORDER: [Behavior; 4] = [Behavior::Stop, Behavior::Spin, Behavior::Walk, Behavior::Turn];

/// Behavior reward, total and shares: judged, baselines, oracle, paper.
pub(super) fn rewards(data: &ReportData) -> Option<Element> {
    let judged = reward_row(&data.judged.supervisor, &data.judged.reward, 3).with("class", "judged");
    let baselines = data.baselines.iter().map(|results| reward_row(&results.supervisor, &results.reward, 3));
    let oracle = oracle_reward(data).map(|reward| reward_row("oracle", reward, 3));
    let paper = reward_row("the paper, in training", &BehaviorReward::PAPER, 2);
    let heads = ["total"].into_iter().chain(PAPER_ORDER.map(Behavior::name));
    let head = Element::new("tr")
        .child(word("th", "supervisor"))
        .children(heads.map(|name| Element::new("th").with("scope", "col").text(name)));
    let body = Element::new("tbody")
        .child(judged)
        .children(baselines)
        .children(oracle)
        .child(paper.with("class", "part"));
    let caption = "Behavior reward: the mean over all scheduled steps, at most 1, and the share that each behavior \
                   adds, at most 0.25. The oracle is given the force itself. The paper’s figures are averages of \
                   training, with exploration noise; all others are measured without it.";
    Some(table(Element::new("caption").text(caption), head, body))
}

/// The oracle's reward, where it is known and has no row as a supervisor of its own.
fn oracle_reward(data: &ReportData) -> Option<&BehaviorReward> {
    let has_row =
        [&data.judged].into_iter().chain(&data.baselines).any(|results| results.supervisor == "oracle");
    let reward = &data.judged.oracle_reward;
    (!has_row && reward.total > 0.0).then_some(reward)
}

fn reward_row(name: &str, reward: &BehaviorReward, decimals: usize) -> Element {
    let values = [reward.total].into_iter().chain(PAPER_ORDER.map(|behavior| reward.share(behavior)));
    Element::new("tr").child(row_head(name)).children(values.map(|value| cell(fixed(value, decimals))))
}

/// Every case; `None` without any.
pub(super) fn cases(data: &ReportData) -> Option<Element> {
    let cases = &data.judged.cases;
    if cases.is_empty() {
        return None;
    }
    let rows = cases.iter().enumerate().map(|(index, case)| {
        let before = index.checked_sub(1).map(|before| cases[before].behavior);
        let row = case_row(case, &data.baselines);
        if before.is_some_and(|before| before != case.behavior) { row.with("class", "part") } else { row }
    });
    let body = Element::new("tbody").children(rows);
    Some(table(case_caption(data), case_heads(&data.baselines), body))
}

fn case_caption(data: &ReportData) -> Element {
    let others =
        if data.baselines.is_empty() { "" } else { " The last columns give the success of the others." };
    Element::new("caption")
        .text("All cases, by their force ")
        .child(symbol("f", "x"))
        .text(" / ")
        .child(symbol("f", "y"))
        .text(" in newtons. Success and its interval in percent; ")
        .child(symbol("v", "x"))
        .text(" and ")
        .child(symbol("v", "y"))
        .text(" in m/s and ")
        .child(symbol("ω", "z"))
        .text(" in rad/s are means over the judged window, after the slash what Table II of the paper asks for; ")
        .text("drift of the heading in degrees per 10 s.")
        .text(others)
        .text(derived(&data.judged))
}

/// The seventeen forces are read from the paper's words, and must not pass as its own list.
fn derived(results: &Results) -> &'static str {
    match results.suite.as_str() {
        "paper17" => " The list of pulls is derived from the paper’s text.",
        "mirror17" => " The list of pulls is derived from the paper’s text, left and right exchanged.",
        _ => "",
    }
}

fn case_heads(baselines: &[Results]) -> Element {
    let index =
        |letter: &str, index: &str| Element::new("th").with("scope", "col").child(symbol(letter, index));
    let plain = |name: &str| Element::new("th").with("scope", "col").text(name);
    Element::new("tr")
        .children([word("th", "case"), word("th", "behavior"), word("th", "group")])
        .children(["success", "95 % interval", "falls"].map(plain))
        .children([index("v", "x"), index("v", "y"), index("ω", "z"), plain("drift")])
        .children(baselines.iter().map(|results| plain(&shortened(&results.supervisor, 20))))
}

fn case_row(case: &CaseResult, baselines: &[Results]) -> Element {
    let [forward, _, yaw_rate] = case.behavior.target([case.fx as f32, case.fy as f32, 0.0]).map(f64::from);
    let [success, low, high] = [case.success_rate, case.wilson_low, case.wilson_high].map(percentage);
    // A case that a baseline has not run shows as not a number does.
    let success_of =
        |results: &Results| results.case(&case.name).map_or(f64::NAN, |other| other.success_rate);
    let others = baselines.iter().map(|results| cell(percentage(success_of(results))));
    Element::new("tr")
        .children([row_head(&case.name), word("td", case.behavior.name()), group_cell(case)])
        .children([cell(success), cell(format!("{low}–{high}")), cell(case.falls.to_string())])
        .child(beside(fixed(case.mean_vx, 2), fixed(forward, 2)))
        .child(cell(fixed(case.mean_vy, 2)))
        .child(beside(fixed(case.mean_wz, 2), fixed(yaw_rate, 2)))
        .child(cell(fixed(case.heading_drift_deg_per_10s, 1)))
        .children(others)
}

pub(super) fn table(caption: Element, head: Element, body: Element) -> Element {
    let table = Element::new("table").child(caption).child(Element::new("thead").child(head)).child(body);
    Element::classed("div", "wide").child(table)
}

fn symbol(letter: &str, index: &str) -> Element {
    Element::new("var").text(letter).child(Element::new("sub").text(index))
}

pub(super) fn cell(text: String) -> Element {
    Element::new("td").text(text)
}

pub(super) fn word(kind: &'static str, text: &str) -> Element {
    Element::classed(kind, "word").text(text)
}

pub(super) fn row_head(text: &str) -> Element {
    Element::classed("th", "word").with("scope", "row").text(text)
}

fn beside(value: String, target: String) -> Element {
    cell(value).child(Element::classed("span", "soft").text(format!(" / {target}")))
}

fn group_cell(case: &CaseResult) -> Element {
    let dot = Element::classed("span", &format!("dot {}", case.group)).with("aria-hidden", "true").text("● ");
    Element::classed("td", "word").child(dot).text(case.group.name())
}
