//! Three more tables: what was lacking, how fast and how gently pulls are answered, and what they were taken for.

use super::ReportData;
use super::markup::Element;
use super::number::{fixed, percentage};
use super::tables::{cell, row_head, table, word};
use crate::results::{Behavior, CaseResult, MissedRow};

/// Columns of the table: head, decimals, value.
type Column = (&'static str, usize, fn(&CaseResult) -> Option<f64>);

const COLUMNS: [Column; 10] = [
    ("command 50 %", 2, |c| c.command_latency_50_s),
    ("command 90 %", 2, |c| c.command_latency_90_s),
    ("velocity 90 %", 2, |c| c.velocity_latency_90_s),
    ("standstill, s", 2, |c| c.stopping_time_s),
    ("standstill, m", 2, |c| c.stopping_distance_m),
    ("switches", 2, |c| c.switches_per_10s),
    ("force, N", 0, |c| c.hand_force_peak_n),
    ("N/s", 0, |c| c.hand_force_rate_nps),
    ("m/s²", 2, |c| c.hand_acceleration_mps2),
    ("m/s³", 2, |c| c.hand_jerk_mps3),
];

/// What the episodes lacked that did not obey; `None` if all did.
pub(super) fn missed(data: &ReportData) -> Option<Element> {
    let found = data.judged.missed()?;
    let plain = |name: &str| Element::new("th").with("scope", "col").text(name);
    let heads = ["not obeyed"].into_iter().chain(found.criteria.iter().copied()).map(plain);
    let head = Element::new("tr").child(word("th", "case")).children(heads);
    let row = |row: &MissedRow<'_>| {
        let shares = [Some(row.not_obeyed)].into_iter().chain(row.lacking.iter().copied());
        let name = if row.is_part { format!("… {}", row.name) } else { row.name.to_owned() };
        let cells = shares.map(|share| cell(share.map_or_else(|| "–".into(), percentage)));
        Element::new("tr").child(row_head(&name)).children(cells)
    };
    let body = Element::new("tbody").children(found.rows.iter().map(row));
    let caption = "What the episodes lacked that did not obey, in percent of all episodes of the row; one may lack several \
                   things. Below a case the kinds of ground and the frictions with which more than a tenth did not.";
    Some(table(Element::new("caption").text(caption), head, body))
}

/// Reactions and comfort of every case; `None` where none was measured.
pub(super) fn reactions(data: &ReportData) -> Option<Element> {
    let cases = &data.judged.cases;
    if cases.iter().all(|case| case.switches_per_10s.is_none()) {
        return None;
    }
    let heads = COLUMNS.map(|(head, ..)| Element::new("th").with("scope", "col").text(head));
    let head = Element::new("tr").child(word("th", "case")).children(heads);
    let row = |case: &CaseResult| {
        let value = |(_, decimals, of): &Column| cell(fixed(of(case).unwrap_or(f64::NAN), *decimals));
        Element::new("tr").child(row_head(&case.name)).children(COLUMNS.iter().map(value))
    };
    let body = Element::new("tbody").children(cases.iter().map(row));
    let falls =
        data.judged.falls_per_1000.map(|falls| format!(" Falls in 1000 episodes: {}.", fixed(falls, 1)));
    let caption = Element::new("caption")
        .text(
            "Reactions and comfort: seconds from the pull until the command and the velocity have made so much of the \
             change that Table II asks for; until the robot stands, and how far it goes until then; changes between \
             behaviors in ten seconds of the same force; and at the hand the largest force, its largest rate, and the \
             largest acceleration and jerk of half-second means. Medians and means of the robots that did not fall.",
        )
        .text(falls.unwrap_or_default());
    Some(table(caption, head, body))
}

/// What was meant against what the motions looked like.
pub(super) fn confusion(data: &ReportData) -> Option<Element> {
    let confusion = data.judged.confusion.as_ref()?;
    let heads = Behavior::ALL.map(|behavior| Element::new("th").with("scope", "col").text(behavior.name()));
    let head = Element::new("tr").child(word("th", "meant")).children(heads);
    let row = |behavior: Behavior| {
        let counts = Behavior::ALL.map(|looked| cell(confusion.row(behavior).of(looked).to_string()));
        Element::new("tr").child(row_head(behavior.name())).children(counts)
    };
    let caption = "Rows: what Table II makes of the force. Columns: the behavior that the motion is nearest to, in \
                   episodes; fallen robots are left out.";
    let body = Element::new("tbody").children(Behavior::ALL.map(row));
    Some(table(Element::new("caption").text(caption), head, body))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::criteria::Miss;
    use crate::measures::reading::Readings;
    use crate::results::Results;

    #[test]
    fn what_was_missed_is_told_in_percent() {
        let mut data = ReportData::default();
        let misses = vec![Miss { of: "place".into(), episodes: 10 }];
        data.judged.cases.push(CaseResult { misses, ..CaseResult::from_counts(40, 30, 0) });
        let text = missed(&data).unwrap().to_string();
        assert!(text.contains("place") && text.contains("<td>25.0</td><td>25.0</td>"), "{text}");
    }

    #[test]
    fn what_was_not_measured_is_left_out_or_a_dash() {
        let mut data = ReportData::default();
        data.judged.cases.push(CaseResult::default());
        assert!(reactions(&data).is_none() && confusion(&data).is_none() && missed(&data).is_none());
        let readings = Readings { walk: 7, ..Readings::default() };
        let case =
            CaseResult { switches_per_10s: Some(1.25), read_as: Some(readings), ..CaseResult::default() };
        data.judged = Results { cases: vec![case], ..Results::default() }.with_sums();
        let text = reactions(&data).unwrap().to_string();
        assert!(text.contains("1.25") && text.contains("<td>–</td>"), "{text}");
        assert!(confusion(&data).unwrap().to_string().contains("<td>7</td>"));
    }
}
