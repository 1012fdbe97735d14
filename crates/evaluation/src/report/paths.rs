//! Paths from above: a panel for each behavior, the same scale along both of its axes, ahead is up and left is left.

use super::chart::{Axes, Scale, extent, figure_file, label, line, panels, place};
use super::legend::{Entry, LINE_HEIGHT, legend};
use super::markup::Element;
use super::number::is_drawable;
use super::page::figure;
use super::{PathTrace, ReportData};
use crate::results::{Behavior, CaseResult};

const PANEL_WIDTH: f64 = 230.0;
const ACROSS: [f64; 2] = [36.0, 214.0];
const DOWN: [f64; 2] = [206.0, 28.0];
/// Even a robot that stands still is shown on this much ground \[m\].
const LEAST_SPAN_M: f64 = 1.0;
/// About so many round values an axis; the same on both, for they are as long.
const TICKS: usize = 4;
/// Length of the stroke that points where the robot heads \[px\].
const HEADING: f64 = 9.0;
/// Headings drawn along a path that lasts very long.
const MOST_HEADINGS: usize = 40;

/// The paths of some cases as an SVG file that stands alone; `None` without a path to draw.
pub fn paths_svg(cases: &[CaseResult], traces: &[PathTrace]) -> Option<String> {
    let (parts, size, name) = draw(cases, traces)?;
    let (placed, [width, height]) = place(parts, size);
    Some(figure_file(width, height, &name).children(placed).to_string())
}

/// The figure; `None` without a path to draw.
pub(super) fn from_above(data: &ReportData) -> Option<Element> {
    let (parts, size, name) = draw(&data.judged.cases, &data.traces)?;
    let caption = "Paths from above, from the moment the force sets in (open circle), in meters; up is ahead. Dots a \
                   second apart carry a stroke that points where the robot heads. Colors as in the figure of success; \
                   every panel has its own scale.";
    Some(figure(panels(parts, size, &name), Element::new("figcaption").text(caption)))
}

/// The panels, the size of each, and what they show together.
fn draw(cases: &[CaseResult], traces: &[PathTrace]) -> Option<(Vec<Element>, [f64; 2], String)> {
    let groups: Vec<(Behavior, Vec<&PathTrace>)> = Behavior::ALL
        .into_iter()
        .map(|behavior| (behavior, drawable_of(traces, behavior)))
        .filter(|(_, traces)| !traces.is_empty())
        .collect();
    if groups.is_empty() {
        return None;
    }
    let drawn: Vec<(Element, f64)> =
        groups.iter().map(|(behavior, traces)| panel(*behavior, traces, cases)).collect();
    let height = drawn.iter().map(|(_, height)| *height).fold(0.0, f64::max);
    let shown: Vec<&str> = groups.iter().map(|(behavior, _)| behavior.name()).collect();
    let name = format!("Paths of the robot seen from above: {}", shown.join(", "));
    Some((drawn.into_iter().map(|(part, _)| part).collect(), [PANEL_WIDTH, height], name))
}

fn drawable_of(traces: &[PathTrace], behavior: Behavior) -> Vec<&PathTrace> {
    let drawable = |trace: &&PathTrace| trace.points.iter().any(|point| on_ground(point).is_some());
    traces.iter().filter(|trace| trace.behavior == behavior).filter(drawable).collect()
}

/// A point as the axes take it, left and ahead.
fn on_ground(point: &[f64; 3]) -> Option<[f64; 2]> {
    (is_drawable(point[0]) && is_drawable(point[1])).then_some([point[1], point[0]])
}

/// One behavior's paths and their legend; gives the height, too.
fn panel(behavior: Behavior, traces: &[&PathTrace], cases: &[CaseResult]) -> (Element, f64) {
    let axes = square_axes(traces);
    let styles = styles(traces, cases);
    let class = |trace: &PathTrace| {
        styles.iter().find(|(case, _)| *case == trace.case).map_or("", |(_, class)| class.as_str())
    };
    let entries = styles
        .iter()
        .map(|(case, class)| Entry::new(line(&format!("trace {class}"), [-11.0, 0.0], [11.0, 0.0]), case));
    let (legend, legend_height) =
        legend(entries.collect(), [ACROSS[0], PANEL_WIDTH + 40.0], DOWN[0] + 26.0, 98.0);
    let part = Element::classed("g", "panel")
        .child(label(ACROSS[0], 14.0, "strong", behavior.name()))
        .children([axes.draw_columns(TICKS), axes.draw_y(TICKS), axes.draw_x(TICKS)])
        .children(traces.iter().map(|trace| draw_trace(trace, class(trace), &axes)))
        .child(start(&axes))
        .child(legend);
    (part, DOWN[0] + 26.0 + legend_height.max(LINE_HEIGHT))
}

/// Axes with as many pixels a meter along as across, around all points and the start; left is on the left.
fn square_axes(traces: &[&PathTrace]) -> Axes {
    let all = |index: usize| {
        let places = traces.iter().flat_map(|trace| trace.points.iter().filter_map(on_ground));
        extent(places.map(move |at| at[index]).chain([0.0])).unwrap_or_default()
    };
    let [left, ahead] = [all(0), all(1)];
    let span = (1.12 * (left[1] - left[0]).max(ahead[1] - ahead[0])).max(LEAST_SPAN_M);
    let around = |ends: [f64; 2]| {
        let middle = 0.5 * (ends[0] + ends[1]);
        [middle - 0.5 * span, middle + 0.5 * span]
    };
    let [right_end, left_end] = around(left);
    Axes { x: Scale::new([left_end, right_end], ACROSS), y: Scale::new(around(ahead), DOWN) }
}

/// For each case its color, that of its group, and dashes that tell it from others of the same color.
fn styles<'a>(traces: &[&'a PathTrace], cases: &[CaseResult]) -> Vec<(&'a str, String)> {
    let mut styles: Vec<(&str, String)> = Vec::new();
    let mut used: Vec<&str> = Vec::new();
    for trace in traces {
        if styles.iter().any(|(case, _)| *case == trace.case) {
            continue;
        }
        let color =
            cases.iter().find(|case| case.name == trace.case).map_or("unknown", |case| case.group.name());
        let before = used.iter().filter(|other| **other == color).count();
        used.push(color);
        styles.push((&trace.case, format!("{color} dash-{}", before % 4)));
    }
    styles
}

fn draw_trace(trace: &PathTrace, class: &str, axes: &Axes) -> Element {
    let points = trace.points.iter().map(|point| on_ground(point).unwrap_or([f64::NAN; 2]));
    let color = class.split(' ').next().unwrap_or_default();
    Element::classed("g", "robot")
        .child(Element::new("title").text(&trace.case))
        .child(axes.draw_line(&format!("trace {class}"), points))
        .children(headings(trace).flat_map(|point| heading(point, color, axes)))
}

/// The points a second apart, or further where that were too many.
fn headings(trace: &PathTrace) -> impl Iterator<Item = &[f64; 3]> {
    let second = if trace.period_s > 0.0 { (1.0 / trace.period_s).round() as usize } else { 1 };
    let stride = second.max(trace.points.len() / MOST_HEADINGS).max(1);
    let drawable = |point: &&[f64; 3]| on_ground(point).is_some() && is_drawable(point[2]);
    trace.points.iter().step_by(stride).filter(drawable)
}

/// A dot and a stroke; a yaw of zero points up, a positive one to the left.
fn heading(point: &[f64; 3], color: &str, axes: &Axes) -> [Element; 2] {
    let [x, y] = [axes.x.at(point[1]), axes.y.at(point[0])];
    let tip = [x - HEADING * point[2].sin(), y - HEADING * point[2].cos()];
    let dot = Element::classed("circle", &format!("spot {color}")).at([("cx", x), ("cy", y), ("r", 1.9)]);
    [dot, line(&format!("heading {color}"), [x, y], tip)]
}

fn start(axes: &Axes) -> Element {
    Element::classed("circle", "start").at([("cx", axes.x.at(0.0)), ("cy", axes.y.at(0.0)), ("r", 4.0)])
}
