//! The figure of success: one bar a case with its interval, colored by group, the baselines as marks over it.

use super::ReportData;
use super::chart::{Scale, figure_file, figure_root, label, line, symbol};
use super::legend::{Entry, legend, marker, swatch, whisker};
use super::markup::{Element, shortened};
use super::number::{counted, fixed, is_drawable, percent};
use super::page::figure;
use crate::results::{Behavior, CaseResult, Group, Results};

const WIDTH: f64 = 920.0;
/// Around a figure that stands alone.
const MARGIN: f64 = 14.0;
/// Left and right end of the bars.
const ACROSS: [f64; 2] = [142.0, 772.0];
/// From one bar to the next.
const PITCH: f64 = 25.0;
const BAR_HEIGHT: f64 = 16.0;
/// Between the bars of two behaviors.
const GAP: f64 = 9.0;

/// The bars of all cases as an SVG file that stands alone, light or dark as its reader likes it.
///
/// Bars and marks are success rates \[%\], whiskers 95 % Wilson intervals. Without cases only the axis is left.
pub fn success_bars_svg(judged: &Results, baselines: &[Results]) -> String {
    let (drawing, height) = draw(judged, baselines);
    let moved = drawing.with("transform", format!("translate({MARGIN} {MARGIN})"));
    let [width, height] = [WIDTH, height].map(|size| size + 2.0 * MARGIN);
    figure_file(width, height, &description(judged)).child(moved).to_string()
}

/// The figure for the page; `None` without cases.
pub(super) fn success(data: &ReportData) -> Option<Element> {
    if data.judged.cases.is_empty() {
        return None;
    }
    let caption = "Episodes that met the criterion of their behavior, for each pull at the harness. Trained: within \
                   the forces of the paper's training; edge: on a threshold of Table II; outside: beyond the paper's \
                   forces (a supervisor may have trained with them).";
    let (drawing, height) = draw(&data.judged, &data.baselines);
    let drawing = figure_root(WIDTH, height, &description(&data.judged)).child(drawing);
    Some(figure(drawing, Element::new("figcaption").text(caption)))
}

/// All that is in the figure; gives its height, too.
fn draw(judged: &Results, baselines: &[Results]) -> (Element, f64) {
    let (legend, legend_height) = legend(entries(judged, baselines), [0.0, WIDTH], 2.0, 1.0);
    let top = legend_height + 30.0;
    let rows = rows(&judged.cases, top);
    let bottom = rows.last().map_or(top, |row| row.middle + PITCH / 2.0) + 2.0;
    let scale = Scale::new([0.0, 1.0], ACROSS);
    let drawing = Element::classed("g", "bars")
        .child(legend)
        .child(grid(scale, [top - 4.0, bottom]))
        .child(heads(&judged.supervisor, top - 13.0))
        .children(behavior_labels(&rows))
        .children(rows.iter().map(|row| draw_row(row, scale, baselines)));
    (drawing, bottom + 24.0)
}

fn description(judged: &Results) -> String {
    let start = format!("Success of {} under {}", judged.supervisor, counted(judged.cases.len(), "pull"));
    match judged.worst_case() {
        Some(worst) => format!("{start}; lowest: {} at {}", worst.name, percent(worst.success_rate)),
        None => start,
    }
}

fn entries(judged: &Results, baselines: &[Results]) -> Vec<Entry> {
    let present = |group: &Group| judged.cases.iter().any(|case| case.group == *group);
    let groups = Group::ALL.into_iter().filter(present).map(|group| Entry::new(swatch(group), group.name()));
    let interval = Entry::new(whisker([-9.0, 9.0], 0.0), "95 % interval");
    let marks = baselines
        .iter()
        .enumerate()
        .map(|(index, results)| Entry::new(marker(index, [0.0, 0.0]), &results.supervisor));
    groups.chain([interval]).chain(marks).collect()
}

/// A case and where its bar lies.
struct Row<'a> {
    case: &'a CaseResult,
    middle: f64,
}

/// Cases by behavior, within one in the suite's order.
fn rows(cases: &[CaseResult], top: f64) -> Vec<Row<'_>> {
    let mut rows = Vec::with_capacity(cases.len());
    let mut y = top;
    for behavior in Behavior::ALL {
        let before = rows.len();
        for case in cases.iter().filter(|case| case.behavior == behavior) {
            rows.push(Row { case, middle: y + PITCH / 2.0 });
            y += PITCH;
        }
        y += if rows.len() > before { GAP } else { 0.0 };
    }
    rows
}

fn grid(scale: Scale, [top, bottom]: [f64; 2]) -> Element {
    let (ticks, _) = scale.ticks(4);
    Element::classed("g", "axis").children(ticks.into_iter().flat_map(|tick| {
        let x = scale.at(tick);
        [line("grid", [x, top], [x, bottom]), label(x, bottom + 16.0, "middle", percent(tick))]
    }))
}

/// Whose bars these are, and what the columns of text beside them hold.
fn heads(supervisor: &str, y: f64) -> Element {
    let force = Element::classed("text", "soft end").at([("x", ACROSS[0] - 10.0), ("y", y)]);
    let force = force.children(symbol("f", "x")).child(Element::new("tspan").at([("dy", -3.0)]).text(" / "));
    let force = force.children(symbol("f", "y")).child(Element::new("tspan").at([("dy", -3.0)]).text(" [N]"));
    let bars = (!supervisor.is_empty()).then(|| format!("bars: {}", shortened(supervisor, 80)));
    let bars = bars.map(|text| label(ACROSS[0], y, "soft", text));
    let right = label(ACROSS[1] + 14.0, y, "soft", "success, falls");
    Element::classed("g", "heads").child(force).children(bars).child(right)
}

fn behavior_labels(rows: &[Row<'_>]) -> Vec<Element> {
    let first = |behavior| rows.iter().find(|row| row.case.behavior == behavior);
    let named =
        |behavior: Behavior| Some(label(0.0, first(behavior)?.middle + 4.0, "strong", behavior.name()));
    Behavior::ALL.into_iter().filter_map(named).collect()
}

fn draw_row(row: &Row<'_>, scale: Scale, baselines: &[Results]) -> Element {
    let Row { case, middle } = *row;
    let name = label(ACROSS[0] - 10.0, middle + 4.0, "end", shortened(&case.name, 14));
    let group = Element::classed("g", "case").child(Element::new("title").text(tooltip(case))).child(name);
    let Some(success) = share(case.success_rate) else { return group };
    let bar = Element::classed("rect", &format!("bar {}", case.group)).at([
        ("x", ACROSS[0]),
        ("y", middle - BAR_HEIGHT / 2.0),
        ("width", scale.at(success) - ACROSS[0]),
        ("height", BAR_HEIGHT),
    ]);
    let interval = share(case.wilson_low).zip(share(case.wilson_high));
    let interval = interval.map(|(low, high)| whisker([scale.at(low), scale.at(high)], middle));
    group
        .child(bar)
        .children(interval)
        .children(marks(case, middle, scale, baselines))
        .child(outcome(case, middle))
}

/// The baselines' success in the same case, each on a line of its own.
fn marks(case: &CaseResult, middle: f64, scale: Scale, baselines: &[Results]) -> Vec<Element> {
    let step = BAR_HEIGHT / baselines.len().max(1) as f64;
    let mark = |(index, results): (usize, &Results)| {
        let success = share(results.case(&case.name)?.success_rate)?;
        let offset = (index as f64 + 0.5) * step - BAR_HEIGHT / 2.0;
        Some(marker(index, [scale.at(success), middle + offset]))
    };
    baselines.iter().enumerate().filter_map(mark).collect()
}

fn outcome(case: &CaseResult, middle: f64) -> Element {
    let falls = if case.falls == 0 { String::new() } else { format!(", {}", counted(case.falls, "fall")) };
    label(ACROSS[1] + 14.0, middle + 4.0, "", percent(case.success_rate))
        .child(Element::classed("tspan", "soft").text(falls))
}

fn tooltip(case: &CaseResult) -> String {
    let [low, high] = [case.wilson_low, case.wilson_high].map(|share| fixed(100.0 * share, 1));
    let counts = format!("{} of {}", case.successes, counted(case.episodes, "episode"));
    let rate = percent(case.success_rate);
    format!("{} ({}, {}): {counts}, {rate}, interval {low} to {high} %", case.name, case.behavior, case.group)
}

/// A share that has a place on the axis.
fn share(value: f64) -> Option<f64> {
    is_drawable(value).then(|| value.clamp(0.0, 1.0))
}
