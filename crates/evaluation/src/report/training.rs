//! Figures of the training: the total reward, and each behavior's share of it.

use super::chart::{Axes, Scale, extent, figure_root, label, line, panels, thinned};
use super::markup::Element;
use super::number::{fixed, is_drawable};
use super::page::figure;
use super::{Curve, TrainingCurves};
use crate::results::{Behavior, BehaviorReward};
use crate::statistics::moving_average;

/// Iterations the bold curves are averaged over.
const WINDOW: usize = 50;
/// Points that a curve is drawn with: two a pixel are as good as all.
const MOST_POINTS: usize = 1800;
/// A behavior's share when every step earns one and all four are asked for equally often, as under the paper's pulls. Trainings with
/// other pulls ask otherwise, so this is no bound; panels show at least this much.
const EQUAL_SHARE: f64 = 0.25;

/// Left and right end of the curve in the panel of a share.
const SHARE_ACROSS: [f64; 2] = [38.0, 186.0];

/// Both figures, each only with something to show.
pub(super) fn figures(curves: &TrainingCurves) -> [Option<Element>; 2] {
    [total(&curves.total), shares(&curves.behaviors)]
}

/// A curve and its running mean, as points of iteration and value.
struct Series {
    raw: Vec<[f64; 2]>,
    smooth: Vec<[f64; 2]>,
}

impl Series {
    /// `None` when the curve holds no value to draw.
    fn new(curve: &Curve) -> Option<Self> {
        let drawable = |value: f64| if is_drawable(value) { value } else { f64::NAN };
        let values: Vec<f64> = curve.points.iter().map(|point| drawable(point.1)).collect();
        extent(values.iter().copied())?;
        let beside = |values: &[f64]| -> Vec<[f64; 2]> {
            curve.points.iter().zip(values).map(|(point, value)| [point.0 as f64, *value]).collect()
        };
        Some(Self { raw: beside(&values), smooth: beside(&moving_average(&values, WINDOW)) })
    }

    fn last(&self) -> f64 {
        self.smooth.iter().rev().map(|point| point[1]).find(|value| is_drawable(*value)).unwrap_or(0.0)
    }
}

/// Axes that hold all series, values from 0 to `top` and at least forty iterations, so that ticks are whole ones.
fn axes(series: &[&Series], top: f64, across: [f64; 2], down: [f64; 2]) -> Axes {
    let all = |index: usize| extent(series.iter().flat_map(|s| s.raw.iter().map(move |point| point[index])));
    let [first, last] = all(0).unwrap_or_default();
    let [low, high] = all(1).unwrap_or_default();
    let first = if first < 0.1 * last { 0.0 } else { first };
    let x = Scale::new([first, last.max(first + 40.0)], across);
    Axes { x, y: Scale::new([low.min(0.0), high.max(top)], down) }
}

fn total(curve: &Curve) -> Option<Element> {
    let series = Series::new(curve)?;
    let (across, down) = ([44.0, 830.0], [268.0, 30.0]);
    let axes = axes(&[&series], 1.0, across, down);
    let paper = BehaviorReward::PAPER.total;
    let name = format!(
        "{} over the iterations of training; at the end {}, the paper reports {}",
        described(curve, "Behavior reward"),
        fixed(series.last(), 2),
        fixed(paper, 2)
    );
    let drawing = figure_root(920.0, 306.0, &name)
        .children([axes.draw_y(5), axes.draw_x(8)])
        .child(label(across[0] - 30.0, 14.0, "soft", "behavior reward"))
        .child(label(across[1], down[0] + 34.0, "soft end", "iteration"))
        .child(axes.draw_line("raw", thinned(&series.raw, MOST_POINTS)))
        .child(paper_line(&axes, across, paper))
        .child(axes.draw_line("smooth", thinned(&series.smooth, MOST_POINTS)))
        .children(end_labels(&axes, across[1], series.last(), paper, "paper "));
    let caption = format!(
        "Behavior reward in training, with exploration noise: each iteration (pale) and the mean of the last {WINDOW} \
         (bold). Dashed: the paper’s average after 3000 iterations, under its own pulls."
    );
    Some(figure(drawing, Element::new("figcaption").text(caption)))
}

fn shares(curves: &[(Behavior, Curve)]) -> Option<Element> {
    let drawn: Vec<(Behavior, &Curve, Series)> =
        curves.iter().filter_map(|(behavior, curve)| Some((*behavior, curve, Series::new(curve)?))).collect();
    let series: Vec<&Series> = drawn.iter().map(|entry| &entry.2).collect();
    if series.is_empty() {
        return None;
    }
    let axes = axes(&series, EQUAL_SHARE, SHARE_ACROSS, [150.0, 30.0]);
    let ends = drawn.iter().map(|(behavior, _, series)| format!("{behavior} {}", fixed(series.last(), 2)));
    let name =
        format!("Shares of the reward in training, at the end: {}", ends.collect::<Vec<_>>().join(", "));
    let parts = drawn.iter().map(|(behavior, curve, series)| share(*behavior, curve, series, &axes));
    let drawing = panels(parts.collect(), [230.0, 176.0], &name);
    let caption = format!(
        "What each behavior adds to the reward over the iterations, mean of the last {WINDOW}: at most the share of the \
         steps that ask for it. Dashed: the paper’s share after 3000 iterations, under its own pulls, which ask for all \
         four equally often ({} each). Other pulls ask otherwise, and lines of two kinds of pulls do not compare.",
        fixed(EQUAL_SHARE, 2)
    );
    Some(figure(drawing, Element::new("figcaption").text(caption)))
}

/// The panel of one behavior.
fn share(behavior: Behavior, curve: &Curve, series: &Series, axes: &Axes) -> Element {
    let [left, right] = SHARE_ACROSS;
    let paper = BehaviorReward::PAPER.share(behavior);
    Element::classed("g", "panel")
        .child(Element::new("title").text(described(curve, behavior.name())))
        .child(label(left, 14.0, "strong", behavior.name()))
        .children([axes.draw_y(5), axes.draw_x(3)])
        .child(paper_line(axes, SHARE_ACROSS, paper))
        .child(axes.draw_line("smooth", thinned(&series.smooth, MOST_POINTS)))
        .children(end_labels(axes, right, series.last(), paper, ""))
}

/// The curve's own name, or other words where it has none.
fn described<'a>(curve: &'a Curve, otherwise: &'a str) -> &'a str {
    if curve.name.trim().is_empty() { otherwise } else { &curve.name }
}

fn paper_line(axes: &Axes, across: [f64; 2], value: f64) -> Element {
    let y = axes.y.at(value);
    line("reference", [across[0], y], [across[1], y])
}

/// Beside the right end: the last value in bold and the paper's, kept from printing over each other.
fn end_labels(axes: &Axes, right: f64, last: f64, paper: f64, prefix: &str) -> [Element; 2] {
    let [own, other] = [axes.y.at(last), axes.y.at(paper)];
    let overlap = (15.0 - (own - other).abs()).max(0.0) / 2.0;
    let push = if own > other { overlap } else { -overlap };
    [
        label(right + 7.0, own + push + 4.0, "strong", fixed(last, 2)),
        label(right + 7.0, other - push + 4.0, "", format!("{prefix}{}", fixed(paper, 2))),
    ]
}
