//! Reward curves of several trainings as one band: the mean of the seeds, and the lowest and highest of them.

use super::Curve;
use super::chart::{Axes, Scale, figure_file, label, line, thinned};
use super::legend::{Entry, curve_style, legend};
use super::markup::Element;
use super::number::{counted, fixed, is_drawable};
use crate::statistics::moving_average;

const WIDTH: f64 = 760.0;
const ACROSS: [f64; 2] = [48.0, 690.0];
/// Height of the axes, and of the title above the legend \[px\].
const HEIGHT: f64 = 254.0;
const TITLE: f64 = 24.0;
/// Iterations a curve is averaged over before seeds are compared.
const WINDOW: usize = 20;
const MOST_POINTS: usize = 700;

/// Trainings that differ in nothing but their seed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Seeds {
    /// What they have in common.
    pub name: String,
    /// A curve a seed.
    pub curves: Vec<Curve>,
}

/// Iterations that all seeds have reached, and there the lowest, the mean, the highest.
type Band = Vec<(f64, [f64; 3])>;

fn band(seeds: &Seeds) -> Band {
    let smooth: Vec<Vec<f64>> = seeds
        .curves
        .iter()
        .map(|curve| moving_average(&curve.points.iter().map(|point| point.1).collect::<Vec<_>>(), WINDOW))
        .collect();
    let shared = smooth.iter().map(Vec::len).min().unwrap_or(0);
    (0..shared)
        .map(|i| {
            let values = smooth.iter().map(|curve| curve[i]);
            let low = values.clone().fold(f64::INFINITY, f64::min);
            let high = values.clone().fold(f64::NEG_INFINITY, f64::max);
            let mean = values.sum::<f64>() / smooth.len() as f64;
            (seeds.curves[0].points[i].0 as f64, [low, mean, high])
        })
        .filter(|(_, values)| values.iter().all(|value| is_drawable(*value)))
        .collect()
}

/// Groups of trainings as an SVG file; values over iterations. `reference` is a dashed line with its name.
pub fn bands_svg(title: &str, groups: &[Seeds], reference: Option<(&str, f64)>) -> String {
    let bands: Vec<(&Seeds, Band)> =
        groups.iter().map(|seeds| (seeds, band(seeds))).filter(|(_, band)| !band.is_empty()).collect();
    let all = || bands.iter().flat_map(|(_, band)| band.iter());
    let last = all().map(|(iteration, _)| *iteration).fold(1.0, f64::max);
    let top = all().map(|(_, values)| values[2]).chain(reference.map(|r| r.1)).fold(0.1, f64::max);
    let bottom = all().map(|(_, values)| values[0]).fold(0.0, f64::min);
    let class = |index: usize| {
        let (color, dash) = curve_style(index);
        format!("{color} dash-{dash}")
    };
    let entries = bands.iter().enumerate().map(|(index, (seeds, _))| {
        let sign = line(&format!("trace {}", class(index)), [-11.0, 0.0], [11.0, 0.0]);
        Entry::new(sign, format!("{} ({})", seeds.name, counted(seeds.curves.len(), "seed")))
    });
    let (legend, legend_height) = legend(entries.collect(), [ACROSS[0], WIDTH], TITLE - 2.0, 1.0);
    let down = [TITLE + legend_height + HEIGHT, TITLE + legend_height];
    let axes = Axes { x: Scale::new([0.0, last], ACROSS), y: Scale::new([bottom, 1.05 * top], down) };
    let ends = bands
        .iter()
        .filter_map(|(seeds, band)| Some(format!("{} {}", seeds.name, fixed(band.last()?.1[1], 2))));
    let name = format!("{title}; at the end: {}", ends.collect::<Vec<_>>().join(", "));
    let drawn = bands.iter().enumerate().flat_map(|(index, (_, band))| draw(band, &class(index), &axes));
    figure_file(WIDTH, down[0] + 44.0, &name)
        .child(label(ACROSS[0], 16.0, "strong", title))
        .child(legend)
        .children([axes.draw_y(5), axes.draw_x(8)])
        .children(drawn)
        .children(reference.into_iter().flat_map(|(name, value)| {
            let y = axes.y.at(value);
            [line("reference", [ACROSS[0], y], [ACROSS[1], y]), label(ACROSS[1] + 6.0, y + 4.0, "soft", name)]
        }))
        .child(label(ACROSS[1], down[0] + 36.0, "soft end", "iteration"))
        .to_string()
}

/// The area between the lowest and the highest, and the mean over it.
fn draw(band: &[(f64, [f64; 3])], class: &str, axes: &Axes) -> [Element; 2] {
    let curve = |index: usize| -> Vec<[f64; 2]> {
        thinned(&band.iter().map(|(x, values)| [*x, values[index]]).collect::<Vec<_>>(), MOST_POINTS)
    };
    let outline = curve(2).into_iter().chain(curve(0).into_iter().rev());
    let corners = outline.map(|[x, y]| format!("{:.1},{:.1}", axes.x.at(x), axes.y.at(y)));
    let area = Element::classed("polygon", &format!("bar {class}"))
        .with("points", corners.collect::<Vec<_>>().join(" "))
        .with("opacity", "0.35");
    [area, axes.draw_line(&format!("trace {class}"), curve(1))]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn constant(value: f64, iterations: u64) -> Curve {
        Curve { name: String::new(), points: (0..iterations).map(|i| (i, value)).collect() }
    }

    #[test]
    fn a_band_spans_its_seeds_as_far_as_all_have_come() {
        let seeds = Seeds {
            name: "three".into(),
            curves: vec![constant(0.2, 50), constant(0.4, 60), constant(0.9, 70)],
        };
        let band = band(&seeds);
        assert_eq!(band.len(), 50);
        let (_, [low, mean, high]) = band[49];
        assert!((low - 0.2).abs() < 1e-9 && (mean - 0.5).abs() < 1e-9 && (high - 0.9).abs() < 1e-9);
        let figure = bands_svg("reward", &[seeds, Seeds::default()], Some(("the paper", 0.61)));
        assert!(figure.contains("at the end: three 0.50") && figure.contains("three (3 seeds)"));
    }

    #[test]
    fn groups_of_one_color_differ_in_their_dashes() {
        let group = |name: &str| Seeds { name: name.into(), curves: vec![constant(0.5, 30)] };
        let figure = bands_svg("reward", &["a", "b", "c", "d"].map(group), None);
        let first = |class: &str| figure.contains(&format!("trace {} {class}", curve_style(0).0));
        assert!(first("dash-0") && first("dash-1") && !first("dash-2"));
    }
}
