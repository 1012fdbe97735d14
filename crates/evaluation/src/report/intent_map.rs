//! The map of intent: what motions look like over the whole plane of forces.

use super::chart::{Axes, Scale, extent, figure_file, label, line, symbol};
use super::legend::{Entry, legend};
use super::markup::Element;
use super::number::{coordinate, counted, percent};
use crate::results::{Behavior, CaseResult, Results};
use crate::suite::suite;
use tasks::guidance::{PULL_THRESHOLD_X_N, PULL_THRESHOLD_Y_N};

const WIDTH: f64 = 760.0;
const ACROSS: [f64; 2] = [58.0, 740.0];
const DOWN: [f64; 2] = [510.0, 46.0];
/// Red, green, blue of walk, stop, turn, spin; told apart by those who see no red or green, too.
const COLORS: [[f64; 3]; 4] =
    [[90.0, 155.0, 212.0], [235.0, 225.0, 205.0], [40.0, 95.0, 70.0], [226.0, 140.0, 50.0]];
/// Of the fallen.
const FALLEN: [f64; 3] = [20.0, 20.0, 20.0];

/// The map as an SVG file: each point in the mix of its episodes' colors, Table II's thresholds as dashed lines, the
/// seventeen pulls of `paper17` as circles. `None` without a plane.
pub fn intent_map_svg(results: &Results) -> Option<String> {
    let plane = results.plane.as_ref()?;
    let cells = Cells::new(&results.cases)?;
    let axes = Axes { x: Scale::new(cells.ends(0), ACROSS), y: Scale::new(cells.ends(1), DOWN) };
    let entries = Behavior::ALL.into_iter().map(|behavior| {
        let mut shares = [0.0; 4];
        shares[behavior as usize] = 1.0;
        Entry::new(swatch(mixed(shares)), behavior.name())
    });
    let entries = entries.chain([Entry::new(swatch(hex(FALLEN)), "fell")]);
    let (legend, _) = legend(entries.collect(), [ACROSS[0], WIDTH], 8.0, 1.0);
    let name = format!(
        "Intent map of {} over {}: {} read as Table II says, beyond 4 N of a threshold",
        results.supervisor,
        counted(results.cases.len(), "force"),
        percent(plane.read_right_beyond_4n)
    );
    let [bottom, middle] = [DOWN[0], 0.5 * (DOWN[0] + DOWN[1])];
    let down = Element::classed("text", "soft").at([("x", 6.0), ("y", middle)]).children(symbol("f", "y"));
    let along = Element::classed("text", "soft middle");
    let along =
        along.at([("x", 0.5 * (ACROSS[0] + ACROSS[1])), ("y", bottom + 38.0)]).children(symbol("f", "x"));
    let unit = |text: Element| text.child(Element::new("tspan").at([("dy", -3.0)]).text(" [N]"));
    let root = figure_file(WIDTH, bottom + 50.0, &name)
        .child(legend)
        .children(cells.rows.iter().flat_map(|row| draw_row(row, &cells, &axes)))
        .children([axes.draw_y(8), axes.draw_x(9)].map(|axis| axis.with("opacity", "0.9")))
        .children(thresholds(&axes, &cells))
        .children(paper_points(&axes))
        .children([unit(down), unit(along)]);
    Some(root.to_string())
}

/// Cases in rows of one f_y each, every row by f_x.
struct Cells<'a> {
    rows: Vec<Vec<&'a CaseResult>>,
    /// Half of the distance of neighbors along each axis \[N\].
    half: [f64; 2],
}

impl<'a> Cells<'a> {
    fn new(cases: &'a [CaseResult]) -> Option<Self> {
        let mut sorted: Vec<&CaseResult> = cases.iter().collect();
        sorted.sort_by(|a, b| a.fy.total_cmp(&b.fy).then(a.fx.total_cmp(&b.fx)));
        let rows: Vec<Vec<&CaseResult>> =
            sorted.chunk_by(|a, b| a.fy == b.fy).map(<[&CaseResult]>::to_vec).collect();
        let (first, second) = (rows.first()?, rows.get(1)?);
        let half = [0.5 * (first.get(1)?.fx - first[0].fx), 0.5 * (second[0].fy - first[0].fy)];
        Some(Self { rows, half })
    }

    /// Outer ends along an axis.
    fn ends(&self, axis: usize) -> [f64; 2] {
        let at = |case: &&CaseResult| if axis == 0 { case.fx } else { case.fy };
        let [low, high] = extent(self.rows.iter().flatten().map(at)).unwrap_or_default();
        [low - self.half[axis], high + self.half[axis]]
    }
}

/// Neighbors of the same color share a rectangle.
fn draw_row<'a>(
    row: &'a [&'a CaseResult],
    cells: &'a Cells<'a>,
    axes: &'a Axes,
) -> impl Iterator<Item = Element> {
    row.chunk_by(|a, b| color(a) == color(b)).map(|run| {
        let (first, last) = (run[0], run[run.len() - 1]);
        let [left, right] = [first.fx - cells.half[0], last.fx + cells.half[0]].map(|x| axes.x.at(x));
        let [top, bottom] = [first.fy + cells.half[1], first.fy - cells.half[1]].map(|y| axes.y.at(y));
        // A little wider, so that no seams show.
        let place = [("x", left), ("y", top), ("width", right - left + 0.3), ("height", bottom - top + 0.3)];
        Element::classed("rect", "cell").at(place).with("fill", color(first))
    })
}

fn color(case: &CaseResult) -> String {
    let readings = case.read_as.unwrap_or_default();
    mixed(Behavior::ALL.map(|behavior| readings.of(behavior) as f64 / case.episodes.max(1) as f64))
}

/// The mix of colors by their shares; what is left over is fallen.
fn mixed(shares: [f64; 4]) -> String {
    let rest = (1.0 - shares.iter().sum::<f64>()).max(0.0);
    hex(std::array::from_fn(|i| (0..4).map(|k| shares[k] * COLORS[k][i]).sum::<f64>() + rest * FALLEN[i]))
}

fn hex(color: [f64; 3]) -> String {
    let [red, green, blue] = color.map(|value| value.round() as u8);
    format!("#{red:02x}{green:02x}{blue:02x}")
}

fn swatch(color: String) -> Element {
    Element::new("rect").at([("x", -9.0), ("y", -5.0), ("width", 18.0), ("height", 10.0)]).with("fill", color)
}

fn thresholds(axes: &Axes, cells: &Cells<'_>) -> [Element; 3] {
    let ([left, right], [low, high]) = (cells.ends(0), cells.ends(1));
    let across =
        |y: f64| line("reference", [axes.x.at(left), axes.y.at(y)], [axes.x.at(right), axes.y.at(y)]);
    let x = axes.x.at(-f64::from(PULL_THRESHOLD_X_N));
    let side = f64::from(PULL_THRESHOLD_Y_N);
    [line("reference", [x, axes.y.at(low)], [x, axes.y.at(high)]), across(side), across(-side)]
}

fn paper_points(axes: &Axes) -> Vec<Element> {
    let point = |case: crate::suite::Case| {
        let [x, y] = [axes.x.at(f64::from(case.force[0])), axes.y.at(f64::from(case.force[1]))];
        let circle = Element::classed("circle", "start").at([("cx", x), ("cy", y), ("r", 4.0)]);
        let name = Element::new("title").text(format!("{} ({})", case.name, case.behavior()));
        circle_with(circle, name, label(x + 6.0, y - 5.0, "strong", case.name))
    };
    suite("paper17").unwrap_or_default().into_iter().map(point).collect()
}

fn circle_with(circle: Element, name: Element, text: Element) -> Element {
    Element::classed("g", "pull").child(name).child(circle).child(text.with("font-size", coordinate(10.0)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measures::reading::Readings;
    use crate::results::PlaneResult;

    #[test]
    fn cells_have_the_mix_of_their_readings_and_equal_neighbors_are_one() {
        assert_eq!(mixed([1.0, 0.0, 0.0, 0.0]), "#5a9bd4");
        assert_eq!(mixed([0.5, 0.5, 0.0, 0.0]), "#a3bed1");
        assert_eq!(mixed([0.0; 4]), "#141414");
        let case = |fx: f64, fy: f64, walk: usize| CaseResult {
            fx,
            fy,
            episodes: 2,
            read_as: Some(Readings { walk, ..Readings::default() }),
            ..CaseResult::default()
        };
        let cases = vec![
            case(0.0, 0.0, 2),
            case(4.0, 0.0, 2),
            case(8.0, 0.0, 0),
            case(0.0, 3.0, 2),
            case(4.0, 3.0, 1),
        ];
        let results = Results { cases, plane: Some(PlaneResult::default()), ..Results::default() };
        let figure = intent_map_svg(&results).unwrap();
        assert_eq!(figure.matches("class=\"cell\"").count(), 4);
        assert_eq!(figure.matches("class=\"pull\"").count(), 17);
        assert_eq!(intent_map_svg(&Results::default()), None);
    }
}
