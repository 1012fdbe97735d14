//! Many small line charts side by side: the numbers of a training, or trainings beside each other.

use super::chart::{Axes, Scale, extent, figure_file, label, line, place, thinned};
use super::legend::{Entry, curve_style, legend};
use super::markup::Element;
use super::number::is_drawable;

const MOST_POINTS: usize = 600;
/// Left of a panel's axes, for the numbers, and right of them \[px\].
const MARGINS: [f64; 2] = [76.0, 14.0];
/// Above and below a panel's axes \[px\].
const BORDERS: [f64; 2] = [30.0, 26.0];

/// How a line is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stroke {
    /// Pale: every value.
    Raw,
    /// Bold: their running mean.
    Smooth,
    /// In the color of a group of lines.
    Group(usize),
}

impl Stroke {
    fn class(self) -> String {
        match self {
            Self::Raw => "raw".into(),
            Self::Smooth => "smooth".into(),
            Self::Group(index) => match curve_style(index) {
                (color, 0) => format!("trace {color}"),
                (color, dash) => format!("trace {color} dash-{dash}"),
            },
        }
    }
}

/// One chart.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Panel {
    /// What is drawn, with its unit.
    pub title: String,
    /// Lines through points (x, y), those above others last.
    pub lines: Vec<(Stroke, Vec<[f64; 2]>)>,
    /// A value to compare with, dashed.
    pub reference: Option<f64>,
}

/// Charts of `size` pixels, up to four in a row, as an SVG file; `across` names the horizontal axis of all of them, `groups` the
/// colors.
pub fn panels_svg(title: &str, across: &str, panels: &[Panel], size: [f64; 2], groups: &[String]) -> String {
    let entries = groups.iter().enumerate().map(|(index, name)| {
        Entry::new(line(&Stroke::Group(index).class(), [-11.0, 0.0], [11.0, 0.0]), name)
    });
    let drawn = place(panels.iter().map(|panel| draw(panel, size)).collect(), size);
    let width = drawn.1[0].max(size[0]);
    let (legend, legend_height) = match groups.len() {
        0 => (Element::new("g"), 0.0),
        _ => legend(entries.collect(), [MARGINS[0], width], 22.0, 1.0),
    };
    let top = 26.0 + legend_height;
    let height = top + drawn.1[1] + 22.0;
    figure_file(width, height, title)
        .child(label(MARGINS[0], 16.0, "strong", title))
        .child(legend)
        .child(Element::new("g").with("transform", format!("translate(0 {top:.0})")).children(drawn.0))
        .child(label(width - MARGINS[1], height - 8.0, "soft end", across))
        .to_string()
}

fn draw(panel: &Panel, [width, height]: [f64; 2]) -> Element {
    let ends = [MARGINS[0], width - MARGINS[1]];
    let down = [height - BORDERS[1], BORDERS[0]];
    let all = |index: usize| {
        let points = panel.lines.iter().flat_map(|(_, points)| points.iter());
        points.filter(|point| point.iter().all(|value| is_drawable(*value))).map(move |point| point[index])
    };
    let [_, last] = extent(all(0)).unwrap_or([0.0, 1.0]);
    let [low, high] = extent(all(1).chain(panel.reference)).unwrap_or([0.0, 1.0]);
    let margin = 0.05 * (high - low);
    let axes = Axes { x: Scale::new([0.0, last], ends), y: Scale::new([low - margin, high + margin], down) };
    let reference = panel.reference.map(|value| axes.y.at(value));
    Element::classed("g", "panel")
        .child(label(ends[0], BORDERS[0] - 12.0, "strong", panel.title.as_str()))
        .children([axes.draw_y(4), axes.draw_x(4)])
        .children(reference.map(|y| line("reference", [ends[0], y], [ends[1], y])))
        .children(
            panel
                .lines
                .iter()
                .map(|(stroke, points)| axes.draw_line(&stroke.class(), thinned(points, MOST_POINTS))),
        )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_panel_and_line_is_drawn_and_groups_are_named() {
        let lines = vec![
            (Stroke::Group(0), vec![[0.0, 0.0], [2.0, 1.0]]),
            (Stroke::Group(4), vec![[0.0, f64::NAN], [1.0, 0.5]]),
        ];
        let panel = Panel { title: "score <1>".into(), lines, reference: Some(0.9) };
        let names = ["plain", "other"].map(str::to_owned);
        let figure = panels_svg("trainings", "minutes", &[panel, Panel::default()], [400.0, 200.0], &names);
        assert_eq!(figure.matches("class=\"panel\"").count(), 2);
        assert!(figure.contains("score &lt;1&gt;") && figure.contains("plain") && figure.contains("minutes"));
        // From the left end of the axes to the right one.
        assert!(figure.contains("<path class=\"trace trained\" d=\"M76 "), "{figure}");
        assert!(figure.contains("L386 ") && figure.contains("trace outside dash-1"));
        assert_eq!(figure.matches("class=\"reference\"").count(), 1);
    }
}
