//! What figures are drawn with: scales, round ticks, axes, lines with gaps, labels.

use super::markup::Element;
use super::number::{coordinate, fixed, is_drawable};
use super::page::FIGURE_STYLE;

/// Where a value lies on the page: a straight line through two pairs of value and pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scale {
    values: [f64; 2],
    pixels: [f64; 2],
}

impl Scale {
    /// Maps `values[0]` to `pixels[0]` and `values[1]` to `pixels[1]`; either may run backward. Ends that are one and
    /// the same, or no numbers, are replaced by what can be drawn.
    pub(super) fn new(values: [f64; 2], pixels: [f64; 2]) -> Self {
        let [from, to] = values.map(|value| if is_drawable(value) { value } else { 0.0 });
        let to = if (to - from).abs() <= 1e-9 * (1.0 + from.abs()) { from + 1.0 + from.abs() } else { to };
        Self { values: [from, to], pixels }
    }

    /// The pixel of a value.
    pub(super) fn at(&self, value: f64) -> f64 {
        let [from, to] = self.values;
        self.pixels[0] + (value - from) / (to - from) * (self.pixels[1] - self.pixels[0])
    }

    /// Round values inside the scale, about so many, and the decimals their labels need.
    pub(super) fn ticks(&self, about: usize) -> (Vec<f64>, usize) {
        let [low, high] = [self.values[0].min(self.values[1]), self.values[0].max(self.values[1])];
        let step = round_step((high - low) / about.max(1) as f64);
        let slack = 1e-6 * step;
        let first = ((low - slack) / step).ceil();
        let count = ((high + slack) / step).floor() - first;
        let ticks = (0..=count as usize).map(|index| (first + index as f64) * step).collect();
        (ticks, decimals_of(step))
    }
}

/// The nearest of 1, 2, 2.5 or 5 times a power of ten.
fn round_step(step: f64) -> f64 {
    let magnitude = 10_f64.powf(step.log10().floor());
    let factor = match step / magnitude {
        ratio if ratio < 1.5 => 1.0,
        ratio if ratio < 2.2 => 2.0,
        ratio if ratio < 3.5 => 2.5,
        ratio if ratio < 7.0 => 5.0,
        _ => 10.0,
    };
    factor * magnitude
}

fn decimals_of(step: f64) -> usize {
    let shows = |decimals: &usize| {
        let scaled = step * 10_f64.powi(*decimals as i32);
        (scaled - scaled.round()).abs() < 1e-6 * scaled
    };
    (0..9).find(shows).unwrap_or(9)
}

/// The smallest and largest value that can be drawn, `None` without any.
pub(super) fn extent(values: impl IntoIterator<Item = f64>) -> Option<[f64; 2]> {
    values
        .into_iter()
        .filter(|value| is_drawable(*value))
        .map(|value| [value, value])
        .reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
}

/// A figure's root: as wide as the page allows, named for those who cannot see it.
pub(super) fn figure_root(width: f64, height: f64, name: &str) -> Element {
    Element::new("svg")
        .with("viewBox", format!("0 0 {} {}", coordinate(width), coordinate(height)))
        .at([("width", width), ("height", height)])
        .with("role", "img")
        .with("aria-label", name)
        .child(Element::new("title").text(name))
}

/// The root of a figure that stands alone in a file, with its looks, light or dark as its reader likes it.
pub(super) fn figure_file(width: f64, height: f64, name: &str) -> Element {
    figure_root(width, height, name)
        .with("xmlns", "http://www.w3.org/2000/svg")
        .child(Element::new("style").verbatim(FIGURE_STYLE))
        .child(Element::classed("rect", "sheet").with("width", "100%").with("height", "100%"))
}

/// Small figures side by side, four in a row, each drawn in its own coordinates.
pub(super) fn panels(parts: Vec<Element>, size: [f64; 2], name: &str) -> Element {
    let (placed, [width, height]) = place(parts, size);
    figure_root(width, height, name).children(placed)
}

/// Small figures moved to their places, four in a row, and the size of all together.
pub(super) fn place(parts: Vec<Element>, size: [f64; 2]) -> (Vec<Element>, [f64; 2]) {
    let columns = parts.len().clamp(1, 4);
    let rows = parts.len().div_ceil(columns);
    let place = |index: usize| [(index % columns) as f64 * size[0], (index / columns) as f64 * size[1]];
    let placed = parts.into_iter().enumerate().map(|(index, part)| {
        let [x, y] = place(index).map(coordinate);
        part.with("transform", format!("translate({x} {y})"))
    });
    (placed.collect(), [size[0] * columns as f64, size[1] * rows as f64])
}

/// Text at a point; the class decides anchor and looks.
pub(super) fn label(x: f64, y: f64, class: &str, text: impl Into<String>) -> Element {
    Element::classed("text", class).at([("x", x), ("y", y)]).text(text)
}

/// A symbol with its index as in print, v with a small x below.
pub(super) fn symbol(letter: &str, index: &str) -> [Element; 2] {
    let index = Element::classed("tspan", "index").at([("dy", 3.0)]).text(index);
    [Element::classed("tspan", "symbol").text(letter), index]
}

/// A straight line between two points.
pub(super) fn line(class: &str, from: [f64; 2], to: [f64; 2]) -> Element {
    Element::classed("line", class).at([("x1", from[0]), ("y1", from[1]), ("x2", to[0]), ("y2", to[1])])
}

/// A pair of axes in a rectangle of the page.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axes {
    /// Horizontal scale.
    pub(super) x: Scale,
    /// Vertical scale.
    pub(super) y: Scale,
}

impl Axes {
    /// Hairlines and labels at round values of the vertical scale.
    pub(super) fn draw_y(&self, about: usize) -> Element {
        let [left, right] = self.x.pixels;
        let (ticks, decimals) = self.y.ticks(about);
        Element::classed("g", "axis").children(ticks.into_iter().flat_map(|tick| {
            let y = self.y.at(tick);
            [line("grid", [left, y], [right, y]), label(left - 8.0, y + 4.0, "end", fixed(tick, decimals))]
        }))
    }

    /// Hairlines at round values of the horizontal scale.
    pub(super) fn draw_columns(&self, about: usize) -> Element {
        let [bottom, top] = self.y.pixels;
        let columns = self.x.ticks(about).0.into_iter().map(|tick| self.x.at(tick));
        Element::classed("g", "axis").children(columns.map(|x| line("grid", [x, bottom], [x, top])))
    }

    /// The base line, with marks and labels at round values of the horizontal scale.
    pub(super) fn draw_x(&self, about: usize) -> Element {
        let [left, right] = self.x.pixels;
        let bottom = self.y.pixels[0];
        let (ticks, decimals) = self.x.ticks(about);
        let base = line("base", [left, bottom], [right, bottom]);
        Element::classed("g", "axis").child(base).children(ticks.into_iter().flat_map(|tick| {
            let x = self.x.at(tick);
            let mark = line("base", [x, bottom], [x, bottom + 4.0]);
            [mark, label(x, bottom + 17.0, "middle", fixed(tick, decimals))]
        }))
    }

    /// A line through points, broken where there is no number; a lone point becomes a dot.
    pub(super) fn draw_line(&self, class: &str, points: impl IntoIterator<Item = [f64; 2]>) -> Element {
        let mut data = String::new();
        let mut pen_down = false;
        for point in points {
            let drawable = point.into_iter().all(is_drawable);
            if drawable {
                let (x, y) = (coordinate(self.x.at(point[0])), coordinate(self.y.at(point[1])));
                let command = if pen_down { format!("L{x} {y}") } else { format!("M{x} {y}h0") };
                data.push_str(&command);
            }
            pen_down = drawable;
        }
        Element::classed("path", class).with("d", data)
    }
}

/// Few enough points to draw: of each run of neighbors only the lowest and the highest, in their order.
pub(super) fn thinned(points: &[[f64; 2]], most: usize) -> Vec<[f64; 2]> {
    let run = points.len().div_ceil(most.max(2) / 2).max(1);
    if run <= 2 {
        return points.to_vec();
    }
    points.chunks(run).flat_map(lowest_and_highest).collect()
}

fn lowest_and_highest(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let drawable = || (0..points.len()).filter(|i| is_drawable(points[*i][1]));
    let by_value = |a: &usize, b: &usize| points[*a][1].total_cmp(&points[*b][1]);
    let (Some(low), Some(high)) = (drawable().min_by(by_value), drawable().max_by(by_value)) else {
        return points[..1].to_vec();
    };
    if low == high { vec![points[low]] } else { vec![points[low.min(high)], points[low.max(high)]] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_are_straight_and_run_either_way() {
        let scale = Scale::new([0.0, 2.0], [100.0, 0.0]);
        assert_eq!([scale.at(0.0), scale.at(1.0), scale.at(2.0)], [100.0, 50.0, 0.0]);
        let degenerate = Scale::new([3.0, 3.0], [0.0, 10.0]);
        assert!(degenerate.at(3.0).is_finite() && degenerate.at(4.0).is_finite());
        assert!(Scale::new([f64::NAN, f64::INFINITY], [0.0, 10.0]).at(0.5).is_finite());
    }

    #[test]
    fn ticks_are_round_and_inside() {
        for (values, ticks, decimals) in [
            ([0.0, 1.0], vec![0.0, 0.2, 0.4, 0.6, 0.8, 1.0], 1),
            ([0.0, 0.25], vec![0.0, 0.05, 0.1, 0.15, 0.2, 0.25], 2),
            ([1500.0, 0.0], vec![0.0, 250.0, 500.0, 750.0, 1000.0, 1250.0, 1500.0], 0),
            ([-0.7, 0.6], vec![-0.5, -0.25, 0.0, 0.25, 0.5], 2),
        ] {
            let (found, shown) = Scale::new(values, [0.0, 1.0]).ticks(5);
            assert_eq!(found.len(), ticks.len(), "{values:?}: {found:?}");
            assert!(found.iter().zip(&ticks).all(|(a, b)| (a - b).abs() < 1e-9), "{values:?}: {found:?}");
            assert_eq!(shown, decimals, "{values:?}");
        }
    }

    #[test]
    fn lines_break_where_there_is_no_number() {
        let scale = Scale::new([0.0, 1.0], [0.0, 10.0]);
        let axes = Axes { x: scale, y: scale };
        let points = [[0.0, 0.0], [0.1, 0.2], [0.2, f64::NAN], [0.3, 0.3]];
        let drawn = axes.draw_line("curve", points).to_string();
        assert_eq!(drawn, "<path class=\"curve\" d=\"M0 0h0L1 2M3 3h0\"/>\n");
    }

    #[test]
    fn thinning_keeps_the_extremes_and_the_order() {
        let mut points: Vec<[f64; 2]> =
            (0..10_000).map(|i| [f64::from(i), (f64::from(i) * 0.01).sin()]).collect();
        points[4321][1] = 7.0;
        points[4322][1] = f64::NAN;
        let few = thinned(&points, 1000);
        assert!(few.len() <= 1000 && few.contains(&[4321.0, 7.0]));
        assert!(few.is_sorted_by(|a, b| a[0] < b[0]));
        assert_eq!(thinned(&points[..10], 1000).len(), 10);
    }
}
