//! The page as a whole: well formed, self-contained, complete, and robust against any data.

use crate::fixture::{classed, curve, full, named, parse, results, text, trace};
use evaluation::report::{Curve, PathTrace, ReportData, TrainingCurves, render, success_bars_svg, write};
use evaluation::results::{Behavior, BehaviorReward, CaseResult, Results};

fn headings(page: &str) -> Vec<String> {
    named(parse(page).root(), "h2").map(text).collect()
}

#[test]
fn a_full_page_is_well_formed_and_has_every_section() {
    let page = render(&full());
    assert!(page.starts_with("<!DOCTYPE html>"));
    let expected = [
        "Behavior reward",
        "Training",
        "Success",
        "Paths",
        "Cases",
        "What counts as success",
        "How this was made",
    ];
    assert_eq!(headings(&page), expected);
    let document = parse(&page);
    assert_eq!(named(document.root(), "svg").count(), 4);
    assert_eq!(named(document.root(), "figcaption").count(), 4);
    assert_eq!(named(document.root(), "title").next().map(text).unwrap(), "A report");
}

#[test]
fn the_setting_says_what_is_not_as_usual() {
    type Change = fn(&mut Results);
    let setting = |change: Change| {
        let mut data = full();
        change(&mut data.judged);
        classed(parse(&render(&data)).root(), "setting").map(text).collect::<String>()
    };
    let usual = setting(|_| ());
    let unusual: [(&str, Change); 5] = [
        ("friction 0.3", |results| results.friction = Some(0.3)),
        ("pulls seen that do not act", |results| results.unloaded = true),
        ("force seen with ±2 N", |results| results.force_noise_n = 2.0),
        ("other sensors' errors 1 of training's", |results| results.sensor_noise = 1.0),
        ("in MuJoCo 4.0.0", |results| results.engine = Some("MuJoCo 4.0.0".into())),
    ];
    for (words, change) in unusual {
        assert!(setting(change).contains(words) && !usual.contains(words), "{words}: {usual}");
    }
}

#[test]
fn what_is_empty_is_left_out_without_an_empty_frame() {
    let nothing = render(&ReportData::default());
    assert_eq!(headings(&nothing), ["Behavior reward"]);
    assert_eq!(named(parse(&nothing).root(), "figure").count(), 0);

    let emptied = ReportData {
        training: Some(TrainingCurves {
            total: Curve::default(),
            behaviors: vec![(Behavior::Walk, Curve::default())],
        }),
        traces: vec![PathTrace::default()],
        notes: Vec::new(),
        ..full()
    };
    assert_eq!(
        headings(&render(&emptied)),
        ["Behavior reward", "Success", "Cases", "What counts as success"]
    );

    let one_curve =
        TrainingCurves { total: Curve::default(), behaviors: vec![(Behavior::Spin, curve([0.1, 0.2]))] };
    let page = render(&ReportData { training: Some(one_curve), ..ReportData::default() });
    assert_eq!(headings(&page), ["Behavior reward", "Training"]);
    assert_eq!(classed(parse(&page).root(), "panel").count(), 1);
}

#[test]
fn text_from_outside_stays_text() {
    let hostile = "</style><script>alert(\"1\")</script>&amp;'\u{7}";
    let shown = hostile.replace('\u{7}', "\u{fffd}");
    let mut data = full();
    data.title = hostile.into();
    data.judged.supervisor = hostile.into();
    data.baselines[0].supervisor = hostile.into();
    data.judged.cases[0].name = hostile.into();
    data.traces[0].case = hostile.into();
    data.training.as_mut().unwrap().total.name = hostile.into();
    data.notes = vec![(hostile.into(), hostile.into())];
    let page = render(&data);
    let document = parse(&page);
    assert_eq!(named(document.root(), "script").count(), 0);
    for element in ["h1", "dd"] {
        assert!(named(document.root(), element).any(|node| text(node) == shown), "{element}");
    }
    assert_eq!(named(parse(&success_bars_svg(&data.judged, &data.baselines)).root(), "script").count(), 0);
}

#[test]
fn nothing_is_fetched_and_nothing_runs() {
    let page = render(&full());
    for word in ["http", "//", "src=", "href=", "url(", "@import", "<script", "javascript", "onload"] {
        assert!(!page.contains(word), "the page holds {word:?}");
    }
}

#[test]
fn every_figure_is_named_for_those_who_cannot_see_it() {
    let page = render(&full());
    for svg in named(parse(&page).root(), "svg") {
        assert_eq!(svg.attribute("role"), Some("img"));
        let name = svg.attribute("aria-label").unwrap();
        assert!(name.len() > 20, "{name}");
        assert_eq!(svg.first_element_child().map(text).as_deref(), Some(name));
    }
}

#[test]
fn the_tables_hold_the_numbers() {
    let page = render(&full());
    let document = parse(&page);
    let rows: Vec<String> = named(document.root(), "tr")
        .map(|row| row.children().map(text).collect::<Vec<_>>().join("|").replace("|\n", ""))
        .collect();
    for expected in [
        "supervisor.onnx|0.912|0.240|0.232|0.230|0.210",
        "oracle|0.876|0.220|0.160|0.130|0.080",
        "the paper, in training|0.61|0.22|0.16|0.13|0.08",
        "0/0|walk|● trained|100.0|98.1–100.0|3|−0.25 / 0.80|0.00|0.00 / 0.00|0.0|95.0",
        "-60/20|stop|● edge|75.0|68.6–80.5|3|−0.25 / 0.00|0.00|0.00 / 0.00|0.0|40.0",
        "0/50|turn|● outside|50.0|43.1–56.9|3|−0.25 / 0.80|0.00|0.00 / 1.00|0.0|20.0",
        "-60/-30|spin|● trained|0.0|0.0–1.9|3|−0.25 / 0.00|0.00|0.00 / −0.60|0.0|10.0",
    ] {
        assert!(rows.iter().any(|row| row == expected), "{expected} is not among {rows:#?}");
    }
    assert_eq!(rows.len(), 5 + 5);
}

#[test]
fn an_oracle_among_the_baselines_has_one_row() {
    let data = ReportData { baselines: vec![results("oracle", [200; 4])], ..full() };
    let page = render(&data);
    let document = parse(&page);
    let rows = named(document.root(), "th").filter(|head| head.attribute("scope") == Some("row")).map(text);
    assert_eq!(rows.filter(|name| name == "oracle").count(), 1);
}

#[test]
fn the_summary_says_what_matters_in_words() {
    let lead = |data: &ReportData| text(classed(parse(&render(data)).root(), "lead").next().unwrap());
    let words = lead(&full());
    for part in ["0.912", "104.1\u{a0}% of the oracle’s 0.876", "the paper reports 0.61", "56.2\u{a0}%"] {
        assert!(words.contains(part), "{part:?} is not in {words:?}");
    }
    assert!(words.contains("at worst under -60/-30 (spin) with 0\u{a0}%"), "{words}");
    assert!(words.contains("12 episodes (1.5\u{a0}%) ended in a fall"), "{words}");
    let mut perfect = ReportData { judged: results("a", [200; 4]), ..ReportData::default() };
    perfect.judged.cases.iter_mut().for_each(|case| case.falls = 0);
    let words = lead(&perfect);
    assert!(words.contains("succeeds in all of 800 episodes"), "{words}");
    assert!(words.contains("No episode ended in a fall"), "{words}");
}

#[test]
fn a_written_file_is_the_page_and_leaves_nothing_beside_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("report.html");
    write(&full(), &path).unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), render(&full()));
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1);
    assert!(write(&full(), &folder.path().join("missing/report.html")).is_err());
}

/// A page in which every number is `value`, with one point, or three of which two are `value`.
fn poisoned(value: f64, length: usize) -> ReportData {
    let points = || [value, 0.5, value].into_iter().take(length);
    let bad = CaseResult {
        fy: value,
        success_rate: value,
        wilson_low: value,
        wilson_high: value,
        mean_vx: value,
        mean_vy: value,
        mean_wz: value,
        heading_drift_deg_per_10s: value,
        behavior: Behavior::Turn,
        ..CaseResult::default()
    };
    let reward = BehaviorReward { total: value, stop: value, walk: value, turn: value, spin: value };
    let judged = Results { cases: vec![bad; length], reward, oracle_reward: reward, ..Results::default() };
    let path = PathTrace {
        points: points().map(|v| [v, v, v]).collect(),
        period_s: value,
        ..trace(Behavior::Turn, "")
    };
    ReportData {
        baselines: vec![judged.clone(); 6],
        judged,
        training: Some(TrainingCurves {
            total: curve(points()),
            behaviors: vec![(Behavior::Turn, curve(points()))],
        }),
        traces: vec![path],
        ..ReportData::default()
    }
}

fn assert_only_numbers(page: &str) {
    let is_bad = |text: &str| {
        let mut words = text.split(|c: char| !c.is_alphanumeric());
        words.any(|word| matches!(word.to_lowercase().as_str(), "nan" | "inf" | "infinity"))
    };
    for node in parse(page).descendants() {
        assert!(!node.text().is_some_and(is_bad), "{:?}", node.text());
        for attribute in node.attributes() {
            assert!(!is_bad(attribute.value()), "{attribute:?}");
        }
    }
}

#[test]
fn no_data_whatever_break_the_page() {
    let values =
        [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, f64::MIN, 1e300, -1e11, 1e-300, 0.0, 7.0];
    for value in values {
        for length in 0..=3 {
            let data = poisoned(value, length);
            assert_only_numbers(&render(&data));
            assert_only_numbers(&success_bars_svg(&data.judged, &data.baselines));
        }
    }
}
