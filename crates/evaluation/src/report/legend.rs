//! The line that says what the signs of a figure mean, and the signs themselves.

use super::chart::{label, line};
use super::markup::{Element, shortened};
use crate::results::Group;

/// Height of one line of a legend \[px\].
pub(super) const LINE_HEIGHT: f64 = 20.0;
/// A sign has this width, its text begins 6 px after \[px\].
const SIGN: f64 = 22.0;
/// Mean width of a character of figure text \[px\]; a guess on the safe side, for nothing here can measure text.
const CHARACTER: f64 = 6.2;

/// Colors of curves and bands, as classes of the style sheet.
const COLORS: [&str; 3] = ["trained", "outside", "edge"];
/// Highest number of dashes that the style sheet has, `dash-3`; 0 is a line without.
const MOST_DASHES: usize = 3;

/// Color and dashes of the curve or band of this number: colors change first.
pub(super) fn curve_style(index: usize) -> (&'static str, usize) {
    (COLORS[index % COLORS.len()], (index / COLORS.len()).min(MOST_DASHES))
}

/// One sign and what it means.
pub(super) struct Entry {
    sign: Element,
    text: String,
}

impl Entry {
    /// A sign drawn around (0, 0), 22 px wide, and its words.
    pub(super) fn new(sign: Element, text: impl AsRef<str>) -> Self {
        Self { sign, text: shortened(text.as_ref(), 44) }
    }

    fn width(&self) -> f64 {
        SIGN + 6.0 + CHARACTER * self.text.chars().count() as f64 + 18.0
    }

    fn draw(self, [x, y]: [f64; 2]) -> Element {
        let at = |x: f64| format!("translate({x:.1} {y:.1})");
        Element::new("g")
            .child(Element::new("g").with("transform", at(x + SIGN / 2.0)).child(self.sign))
            .child(label(x + SIGN + 6.0, y + 4.0, "", self.text))
    }
}

/// Draws entries from the left, each at a multiple of `tab`, in as many lines as they need; gives their height, too.
pub(super) fn legend(entries: Vec<Entry>, [left, right]: [f64; 2], top: f64, tab: f64) -> (Element, f64) {
    let mut drawn = Element::classed("g", "legend");
    let (mut x, mut y) = (left, top + LINE_HEIGHT / 2.0);
    for entry in entries {
        let width = (entry.width() / tab).ceil() * tab;
        if x > left && x + width > right {
            (x, y) = (left, y + LINE_HEIGHT);
        }
        drawn = drawn.child(entry.draw([x, y]));
        x += width;
    }
    (drawn, y + LINE_HEIGHT / 2.0 - top)
}

/// A filled box in the color of a group.
pub(super) fn swatch(group: Group) -> Element {
    Element::classed("rect", &format!("bar {group}")).at([
        ("x", -9.0),
        ("y", -5.0),
        ("width", 18.0),
        ("height", 10.0),
    ])
}

/// A horizontal error bar from `low` to `high`.
pub(super) fn whisker([low, high]: [f64; 2], y: f64) -> Element {
    let cap = |x: f64| line("whisker", [x, y - 3.5], [x, y + 3.5]);
    let bar = line("whisker", [low, y], [high, y]);
    Element::classed("g", "interval").children([bar, cap(low), cap(high)])
}

/// The mark of a baseline: shapes differ, so that color need not.
pub(super) fn marker(index: usize, [x, y]: [f64; 2]) -> Element {
    let shape = |corners: &[[f64; 2]]| {
        let points = corners.iter().map(|[dx, dy]| format!("{:.2},{:.2}", x + dx, y + dy));
        Element::classed("polygon", "marker").with("points", points.collect::<Vec<_>>().join(" "))
    };
    match index % 4 {
        0 => Element::classed("circle", "marker").at([("cx", x), ("cy", y), ("r", 3.1)]),
        1 => shape(&[[-2.8, -2.8], [2.8, -2.8], [2.8, 2.8], [-2.8, 2.8]]),
        2 => shape(&[[0.0, -4.0], [4.0, 0.0], [0.0, 4.0], [-4.0, 0.0]]),
        _ => shape(&[[0.0, -3.6], [3.7, 2.8], [-3.7, 2.8]]),
    }
}
