//! Results as tables that a person reads on the terminal.

use evaluation::measures::reading::Confusion;
use evaluation::results::{
    Behavior, BehaviorReward, CaseResult, Group, MissedRow, MissedTable, PlaneResult, Results,
};
use evaluation::statistics::median;

/// All tables of some results.
pub fn table(results: &Results) -> String {
    let mut text = head(results);
    // A plane of forces is for its figure; its table would be a book.
    if results.plane.is_none() {
        let width = results.cases.iter().map(|case| case.name.len()).max().unwrap_or(0).max(9);
        text += &success(results, width);
        text += &measures(results, width);
        text += &missed(results, width);
        text += &splits(results, width);
    }
    text += &results.plane.as_ref().map(plane).unwrap_or_default();
    text += &results.confusion.as_ref().map(confusion).unwrap_or_default();
    if let Some(falls) = results.falls_per_1000 {
        text += &format!("\nfalls per 1000 episodes: {falls:.1}\n");
    }
    for group in Group::ALL {
        if let Some(rate) = results.group_success(group) {
            text += &format!("success, {group}: {rate:.3}\n");
        }
    }
    text + &rewards(results)
}

/// Two judgments of the same suite, case by case: two engines, or two policies.
pub fn side_by_side(one: &Results, other: &Results) -> String {
    let [left, right] = apart(one, other);
    let mut text = format!("{}{}left: {left}; right: {right}\n\n", head(one), head(other));
    let width = one.cases.iter().map(|case| case.name.len()).max().unwrap_or(0).max(9);
    text += &format!("{:width$} behavior      success        falls        v_x           ω_z\n", "case");
    let both = |a: f64, b: f64, decimals: usize| format!("{a:7.decimals$}{b:7.decimals$}");
    for case in &one.cases {
        let Some(beside) = other.case(&case.name) else { continue };
        text += &format!(
            "{:width$} {:8}{}{:7}{:5}{}{}\n",
            case.name,
            case.behavior,
            both(case.success_rate, beside.success_rate, 3),
            case.falls,
            beside.falls,
            both(case.mean_vx, beside.mean_vx, 2),
            both(case.mean_wz, beside.mean_wz, 2)
        );
    }
    text += "\nbehavior reward   total   stop   spin   walk   turn\n";
    for (name, results) in [(left, one), (right, other)] {
        let r = results.reward;
        text += &format!(
            "{:16} {:6.3} {:6.3} {:6.3} {:6.3} {:6.3}\n",
            ending(&name),
            r.total,
            r.stop,
            r.spin,
            r.walk,
            r.turn
        );
    }
    text
}

/// Names that tell two judgments apart: of their engines, or else of their supervisors or walks.
fn apart(one: &Results, other: &Results) -> [String; 2] {
    let names: [fn(&Results) -> String; 3] = [
        |results| results.engine.clone().unwrap_or_else(|| "guidedog".into()),
        |results| results.supervisor.clone(),
        |results| results.locomotion.clone(),
    ];
    let pairs = names.map(|name| [name(one), name(other)]);
    let differs = |pair: &&[String; 2]| pair[0] != pair[1];
    pairs.iter().find(differs).unwrap_or(&pairs[0]).clone()
}

/// As much of a name's end as a column holds: files differ there.
fn ending(name: &str) -> String {
    name.chars().skip(name.chars().count().saturating_sub(16)).collect()
}

/// The median of some values (of an even count the mean of the middle two) and, where they differ, the least and the greatest:
/// `0.80 (0.75 to 0.90)`. What is missing is called "not", and counts as greater than any number.
pub fn spread(values: Vec<Option<f64>>, decimals: usize) -> String {
    let mut values: Vec<f64> = values.into_iter().map(|value| value.unwrap_or(f64::INFINITY)).collect();
    values.sort_by(f64::total_cmp);
    let show = |value: f64| if value.is_finite() { format!("{value:.decimals$}") } else { "not".into() };
    match values.as_slice() {
        [] => String::new(),
        [first, .., last] if show(*first) == show(*last) => show(*first),
        [only] => show(*only),
        [first, .., last] => {
            let middle = median(&values).map_or_else(String::new, show);
            format!("{middle} ({} to {})", show(*first), show(*last))
        }
    }
}

fn head(results: &Results) -> String {
    let level = if results.ground == "flat" { String::new() } else { format!(" of level {}", results.level) };
    let engine = results.engine.as_ref().map(|engine| format!(" in {engine}")).unwrap_or_default();
    let noise = match results.force_noise_n {
        0.0 => String::new(),
        noise => format!(", force seen with ±{noise} N"),
    };
    let sensors = match results.sensor_noise {
        0.0 => String::new(),
        scale => format!(", other sensors' errors {scale} of training's"),
    };
    let friction = results.friction.map(|friction| format!(", friction {friction}")).unwrap_or_default();
    format!(
        "{} on {} ground{level}{engine}, {} episodes a case{}{}{friction}{noise}{sensors}; locomotion {}, supervisor {}\n",
        results.suite,
        results.ground,
        results.episodes,
        if results.randomize { ", randomized" } else { "" },
        if results.unloaded { ", unloaded" } else { "" },
        results.locomotion,
        results.supervisor
    )
}

fn success(results: &Results, width: usize) -> String {
    let name = "case";
    let mut text = format!(
        "\n{name:width$} behavior group    success  95 % interval  falls    v_x    v_y    ω_z  drift °/10 s\n"
    );
    for case in &results.cases {
        text += &format!(
            "{:width$} {:8} {:8} {:7.3}  {:.3} to {:.3} {:6} {:6.2} {:6.2} {:6.2} {:13.1}\n",
            case.name,
            case.behavior,
            case.group,
            case.success_rate,
            case.wilson_low,
            case.wilson_high,
            case.falls,
            case.mean_vx,
            case.mean_vy,
            case.mean_wz,
            case.heading_drift_deg_per_10s
        );
    }
    text
}

fn number(value: Option<f64>, width: usize, decimals: usize) -> String {
    let text = value.map_or_else(|| "–".into(), |value| format!("{value:.decimals$}"));
    format!("{text:>width$}")
}

/// Reactions, standstill, changes of mind, and what the hand feels.
fn measures(results: &Results, width: usize) -> String {
    let row = |name: &str, case: &CaseResult| {
        [
            format!("{name:width$}"),
            number(case.command_latency_50_s, 8, 2),
            number(case.command_latency_90_s, 6, 2),
            number(case.velocity_latency_90_s, 9, 2),
            number(case.stopping_time_s, 8, 2),
            number(case.stopping_distance_m, 6, 2),
            number(case.switches_per_10s, 9, 2),
            number(case.hand_force_peak_n, 8, 0),
            number(case.hand_force_rate_nps, 6, 0),
            number(case.hand_acceleration_mps2, 8, 2),
            number(case.hand_jerk_mps3, 6, 2),
        ]
        .concat()
    };
    if results.cases.iter().all(|case| case.switches_per_10s.is_none()) {
        return String::new();
    }
    let mut text = format!(
        "\n{:width$} command to   velocity  standstill   switches  hand: N    N/s  m/s², m/s³\n{:width$}  50 %  90 %   to 90 % s       s     m   in 10 s\n",
        "case", ""
    );
    results.cases.iter().for_each(|case| text += &(row(&case.name, case) + "\n"));
    text
}

/// What the episodes lacked that did not obey.
fn missed(results: &Results, width: usize) -> String {
    let Some(MissedTable { criteria, rows }) = results.missed() else { return String::new() };
    let name = |row: &MissedRow<'_>| format!("{}{}", if row.is_part { "  " } else { "" }, row.name);
    let width = rows.iter().map(|row| name(row).len()).max().unwrap_or(0).max(width);
    let mut text = format!("\n{:width$}  not obeyed  for want of:", "case");
    criteria.iter().for_each(|criterion| text += &format!("{criterion:>11}"));
    for row in &rows {
        text += &format!("\n{:width$} {:11.3}{:14}", name(row), row.not_obeyed, "");
        row.lacking.iter().for_each(|&share| text += &number(share, 11, 3));
    }
    text + "\n"
}

/// Success by what the episodes of a case met, with how many met it.
fn splits(results: &Results, width: usize) -> String {
    let mut columns: Vec<&str> = Vec::new();
    for split in results.cases.iter().flat_map(|case| &case.splits) {
        if !columns.contains(&split.of.as_str()) {
            columns.push(&split.of);
        }
    }
    if columns.is_empty() {
        return String::new();
    }
    let mut text = format!("\n{:width$}", "case");
    columns.iter().for_each(|column| text += &format!("{column:>20}"));
    for case in &results.cases {
        text += &format!("\n{:width$}", case.name);
        for column in &columns {
            let split = case.splits.iter().find(|split| split.of == *column);
            let cell = split.map_or_else(
                || "–".into(),
                |s| format!("{:.3} of {:4}", s.successes as f64 / s.episodes.max(1) as f64, s.episodes),
            );
            text += &format!("{cell:>20}");
        }
    }
    text + "\n"
}

fn plane(plane: &PlaneResult) -> String {
    let mut text = format!(
        "\nread as Table II says, beyond 4 N of a threshold: {:.4} ({:.4} to {:.4})\nleft less right: {:+.4}\n\n\
         threshold                                 N    bias   width\n",
        plane.read_right_beyond_4n, plane.read_right_low, plane.read_right_high, plane.left_right_asymmetry
    );
    for threshold in &plane.thresholds {
        let [bias, width] = [threshold.bias_n, threshold.width_n].map(|value| number(value, 8, 2));
        text += &format!("{:38} {:4.0}{bias}{width}\n", threshold.name, threshold.nominal_n);
    }
    text
}

fn confusion(confusion: &Confusion) -> String {
    let mut text = "\nmeant      looked like walk    stop    turn    spin\n".to_owned();
    for behavior in Behavior::ALL {
        let row = confusion.row(behavior);
        text += &format!("{:19}", behavior.name());
        for looked in Behavior::ALL {
            text += &format!("{:8}", row.of(looked));
        }
        text += "\n";
    }
    text
}

/// Nothing where no reward was measured.
fn rewards(results: &Results) -> String {
    if results.reward.total == 0.0 {
        return String::new();
    }
    let mut text = "\nbehavior reward   total   stop   spin   walk   turn\n".to_owned();
    let mut rows = vec![
        (results.supervisor.as_str(), results.reward),
        ("oracle", results.oracle_reward),
        ("the paper", BehaviorReward::PAPER),
    ];
    // Where the oracle is judged its two rows are one.
    rows.dedup_by_key(|(name, _)| *name);
    for (name, r) in rows.into_iter().filter(|(_, reward)| reward.total > 0.0) {
        text += &format!(
            "{:16} {:6.3} {:6.3} {:6.3} {:6.3} {:6.3}\n",
            ending(name),
            r.total,
            r.stop,
            r.spin,
            r.walk,
            r.turn
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use evaluation::criteria::Miss;

    use super::*;

    #[test]
    fn a_spread_has_the_median_in_the_middle_and_what_is_missing_at_the_end() {
        let of = |values: &[f64], missing: usize| {
            let missing = std::iter::repeat_n(None, missing);
            spread(values.iter().copied().map(Some).chain(missing).collect(), 1)
        };
        assert_eq!(of(&[3.0, 1.0, 2.0], 0), "2.0 (1.0 to 3.0)");
        assert_eq!(of(&[4.0, 1.0, 3.0, 2.0], 0), "2.5 (1.0 to 4.0)");
        assert_eq!(of(&[2.0, 1.0], 1), "2.0 (1.0 to not)");
        assert_eq!(of(&[2.0, 1.0], 2), "not (1.0 to not)");
    }

    #[test]
    fn the_oracle_judged_has_one_row() {
        let reward = BehaviorReward { total: 0.9, ..BehaviorReward::default() };
        let of = |name: &str| {
            let supervisor = name.to_owned();
            rewards(&Results { supervisor, reward, oracle_reward: reward, ..Results::default() })
        };
        assert_eq!(of("oracle").matches("oracle").count(), 1);
        assert_eq!(of("rules").matches("oracle").count(), 1);
        assert_eq!(rewards(&Results::default()), "");
    }

    #[test]
    fn two_judgments_are_called_by_what_differs_and_both_are_told_of() {
        let results = |engine: Option<&str>, supervisor: &str, episodes| Results {
            engine: engine.map(str::to_owned),
            supervisor: supervisor.into(),
            episodes,
            ..Results::default()
        };
        let (one, other) = (results(None, "runs/a/policy.onnx", 20), results(None, "rules", 30));
        let text = side_by_side(&one, &other);
        assert!(text.contains("left: runs/a/policy.onnx; right: rules\n"), "{text}");
        assert!(text.contains("20 episodes a case") && text.contains("30 episodes a case"), "{text}");
        assert!(text.contains("\nns/a/policy.onnx  0.000") && text.contains("\nrules "), "{text}");
        let text = side_by_side(&one, &results(Some("MuJoCo"), "rules", 20));
        assert!(text.contains("left: guidedog; right: MuJoCo\n"), "{text}");
    }

    #[test]
    fn what_is_missed_is_shown_for_the_cases_that_miss_it() {
        let miss = |of: &str, episodes| Miss { of: of.into(), episodes };
        let case = |name: &str, obeyed, misses| CaseResult {
            name: name.into(),
            misses,
            ..CaseResult::from_counts(50, obeyed, 0)
        };
        let spin = case("-100/50", 38, vec![miss("place", 4), miss("yaw rate", 10)]);
        let stop = case("-60/0", 48, vec![miss("place", 2)]);
        let results = Results { cases: vec![case("0/0", 50, vec![]), spin, stop], ..Results::default() };
        let expected = "\ncase       not obeyed  for want of:      place   yaw rate\n\
             -100/50         0.240                    0.080      0.200\n\
             -60/0           0.040                    0.040          –\n";
        assert_eq!(missed(&results, 9), expected);
    }
}
