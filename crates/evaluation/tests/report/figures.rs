//! What figures show is where the numbers say.

use crate::fixture::{case, classed, curve, full, named, number, parse, results, text, trace};
use evaluation::report::{ReportData, TrainingCurves, render, success_bars_svg};
use evaluation::results::{Behavior, Group};
use roxmltree::Node;

/// Coordinates are written with two decimals.
const ROUNDING: f64 = 0.011;

fn assert_near(found: f64, expected: f64) {
    assert!((found - expected).abs() <= ROUNDING, "found {found}, expected {expected}");
}

/// Left and right end of the axis, from its outermost lines.
fn axis_ends(root: Node<'_, '_>) -> [f64; 2] {
    let lines: Vec<f64> = classed(root, "grid").map(|line| number(line, "x1")).collect();
    [lines.iter().copied().fold(f64::MAX, f64::min), lines.iter().copied().fold(f64::MIN, f64::max)]
}

/// The points of a path such as "M1 2h0L3 4".
fn points(path: Node<'_, '_>) -> Vec<[f64; 2]> {
    let data = path.attribute("d").unwrap().replace("h0", "");
    let pairs = data.split(['M', 'L']).filter(|pair| !pair.is_empty());
    pairs.map(|pair| pair.split_once(' ').map(|(x, y)| [x, y].map(|n| n.parse().unwrap())).unwrap()).collect()
}

#[test]
fn bars_whiskers_and_marks_are_proportional_to_success() {
    let data = full();
    let figure = success_bars_svg(&data.judged, &data.baselines);
    let document = parse(&figure);
    let [left, right] = axis_ends(document.root());
    let rows: Vec<Node<'_, '_>> = classed(document.root(), "case").collect();
    assert_eq!(rows.len(), 4);
    for (row, (case, baseline)) in rows.iter().zip(data.judged.cases.iter().zip(&data.baselines[0].cases)) {
        let bar = classed(*row, "bar").next().unwrap();
        assert_eq!(bar.attribute("class").unwrap(), format!("bar {}", case.group));
        assert_near(number(bar, "x"), left);
        assert_near(number(bar, "width"), case.success_rate * (right - left));
        let whisker = classed(*row, "whisker").next().unwrap();
        assert_near(number(whisker, "x1"), left + case.wilson_low * (right - left));
        assert_near(number(whisker, "x2"), left + case.wilson_high * (right - left));
        let mark = classed(*row, "marker").next().unwrap();
        assert_near(number(mark, "cx"), left + baseline.success_rate * (right - left));
        assert!(text(*row).contains(&case.name));
    }
}

#[test]
fn a_baseline_is_matched_by_the_name_of_the_case() {
    let mut data = full();
    data.baselines[0].cases.reverse();
    data.baselines[0].cases.remove(0);
    let figure = success_bars_svg(&data.judged, &data.baselines);
    let document = parse(&figure);
    let marks: Vec<usize> =
        classed(document.root(), "case").map(|row| classed(row, "marker").count()).collect();
    assert_eq!(marks, [1, 1, 1, 0]);
    let first = classed(document.root(), "case").next().unwrap();
    let [left, right] = axis_ends(document.root());
    assert_near(number(classed(first, "marker").next().unwrap(), "cx"), left + 0.95 * (right - left));
}

#[test]
fn bars_of_one_behavior_stand_together_and_none_overlap() {
    let mut judged = results("a", [1, 2, 3, 4]);
    judged.cases.push(case("20/0", 0.0, Group::Outside, Behavior::Walk, 5));
    let figure = success_bars_svg(&judged, &[]);
    let document = parse(&figure);
    let bars: Vec<Node<'_, '_>> =
        classed(document.root(), "case").map(|row| classed(row, "bar").next().unwrap()).collect();
    let classes: Vec<&str> = bars.iter().map(|bar| bar.attribute("class").unwrap()).collect();
    assert_eq!(classes, ["bar trained", "bar outside", "bar edge", "bar outside", "bar trained"]);
    for pair in bars.windows(2) {
        assert!(number(pair[0], "y") + number(pair[0], "height") < number(pair[1], "y"));
    }
    let height = number(document.root_element(), "height");
    assert!(number(*bars.last().unwrap(), "y") < height);
}

#[test]
fn the_figure_of_bars_stands_alone() {
    let figure = success_bars_svg(&full().judged, &[]);
    let document = parse(&figure);
    assert_eq!(document.root_element().tag_name().namespace(), Some("http://www.w3.org/2000/svg"));
    assert!(named(document.root(), "style").map(text).any(|style| style.contains("prefers-color-scheme")));
}

#[test]
fn curves_and_the_line_of_the_paper_share_one_scale() {
    let training = TrainingCurves { total: curve((0..200).map(|_| 0.25)), behaviors: Vec::new() };
    let page = render(&ReportData { training: Some(training), ..ReportData::default() });
    let document = parse(&page);
    let grid: Vec<f64> = classed(document.root(), "grid").map(|line| number(line, "y1")).collect();
    let (zero, one) = (grid[0], *grid.last().unwrap());
    let at = |value: f64| zero + value * (one - zero);
    let paper = classed(document.root(), "reference").next().unwrap();
    assert_near(number(paper, "y1"), at(0.61));
    for class in ["raw", "smooth"] {
        let points = points(classed(document.root(), class).next().unwrap());
        assert_eq!(points.len(), 200);
        assert!(points.iter().all(|point| (point[1] - at(0.25)).abs() <= ROUNDING), "{class}");
    }
}

#[test]
fn the_bold_curve_is_the_mean_of_fifty() {
    let spike = curve((0..200).map(|i| if i == 100 { 1.0 } else { 0.0 }));
    let training = TrainingCurves { total: spike, behaviors: Vec::new() };
    let page = render(&ReportData { training: Some(training), ..ReportData::default() });
    let document = parse(&page);
    let raised = |class| {
        let points = points(classed(document.root(), class).next().unwrap());
        points.iter().filter(|point| point[1] < points[0][1] - ROUNDING).count()
    };
    assert_eq!((raised("raw"), raised("smooth")), (1, 50));
}

#[test]
fn paths_have_one_scale_ahead_is_up_and_left_is_left() {
    let mut bent = trace(Behavior::Turn, "0/50");
    bent.points.push([4.0, 2.0, 0.0]);
    let page = render(&ReportData { traces: vec![bent], ..full() });
    let document = parse(&page);
    let path = classed(document.root(), "trace").next().unwrap();
    assert_eq!(path.attribute("class"), Some("trace outside dash-0"));
    let points = points(path);
    let [start, ahead, left] = [points[0], points[40], points[41]];
    assert_near(ahead[0], start[0]);
    assert!(ahead[1] < start[1] && left[0] < ahead[0]);
    assert!(((start[1] - ahead[1]) - 2.0 * (ahead[0] - left[0])).abs() < 3.0 * ROUNDING);
}

#[test]
fn headings_are_a_second_apart_and_point_where_the_robot_does() {
    let page = render(&ReportData { traces: vec![trace(Behavior::Turn, "0/50")], ..full() });
    let document = parse(&page);
    let strokes: Vec<[f64; 2]> = classed(document.root(), "heading")
        .map(|node| [("x1", "x2"), ("y1", "y2")].map(|(from, to)| number(node, to) - number(node, from)))
        .collect();
    assert_eq!(strokes.len(), 5);
    let (first, last, up) = (strokes[0], strokes[4], -strokes[0][1]);
    assert!(up > 5.0);
    assert_near(first[0], 0.0);
    assert_near(last[0], -up);
    assert_near(last[1], 0.0);
}

#[test]
fn paths_stay_inside_their_panel() {
    let wavy = |size: f64| {
        let mut trace = trace(Behavior::Turn, "0/50");
        trace.points.iter_mut().enumerate().for_each(|(i, point)| point[1] = size * (i as f64).sin());
        trace
    };
    let page = render(&ReportData { traces: vec![wavy(0.01), wavy(30.0), wavy(-2.0)], ..full() });
    let document = parse(&page);
    let robots: Vec<Node<'_, '_>> = classed(document.root(), "robot").collect();
    let grid: Vec<Node<'_, '_>> = classed(robots[0].parent().unwrap(), "grid").collect();
    let ends = |names: [&str; 2]| {
        let all = || grid.iter().flat_map(|line| names.map(|name| number(*line, name)));
        [all().fold(f64::MAX, f64::min), all().fold(f64::MIN, f64::max)]
    };
    let inside = [ends(["x1", "x2"]), ends(["y1", "y2"])];
    for point in robots.iter().flat_map(|robot| points(classed(*robot, "trace").next().unwrap())) {
        let is_inside = point.iter().zip(inside).all(|(at, [low, high])| low <= *at && *at <= high);
        assert!(is_inside, "{point:?} is not in {inside:?}");
    }
}

#[test]
fn cases_of_one_color_differ_in_their_dashes() {
    let mut data = full();
    data.judged.cases[1].group = Group::Trained;
    data.traces =
        ["0/0", "-60/20", "0/0", "0/50", "unheard of"].map(|case| trace(Behavior::Stop, case)).to_vec();
    let page = render(&data);
    let document = parse(&page);
    let classes: Vec<&str> = classed(document.root(), "robot")
        .map(|robot| classed(robot, "trace").next().unwrap().attribute("class").unwrap())
        .collect();
    let expected = [
        "trace trained dash-0",
        "trace trained dash-1",
        "trace trained dash-0",
        "trace outside dash-0",
        "trace unknown dash-0",
    ];
    assert_eq!(classes, expected);
}
