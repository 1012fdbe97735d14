//! What the episodes lacked that did not obey, as a table: shares of all episodes of a row, which may lack several things.

use super::Results;
use crate::criteria::{Criterion, Miss};

/// Kinds of ground and frictions have a row where more than this share of the episodes does not obey.
const WORTH_TELLING: f64 = 0.1;

/// Cases that were not always obeyed, each followed by the kinds of ground and the frictions with which it often was not.
#[derive(Clone, Debug, PartialEq)]
pub struct MissedTable<'a> {
    /// Names of the columns.
    pub criteria: Vec<&'static str>,
    /// The rows.
    pub rows: Vec<MissedRow<'a>>,
}

/// Episodes of a case, or those of them that have something in common.
#[derive(Clone, Debug, PartialEq)]
pub struct MissedRow<'a> {
    /// The case's name, or what its episodes have in common.
    pub name: &'a str,
    /// Whether these are some of the episodes of the case above.
    pub is_part: bool,
    /// Share of the episodes that did not obey.
    pub not_obeyed: f64,
    /// Share that lacks what each column names; `None` where no episode does.
    pub lacking: Vec<Option<f64>>,
}

impl Results {
    /// The table; `None` if all obeyed, or for a plane of forces, of which it would be a book.
    pub fn missed(&self) -> Option<MissedTable<'_>> {
        let cases = self.cases.iter().filter(|case| self.plane.is_none() && !case.misses.is_empty());
        let counted: Vec<Counted<'_>> = cases
            .flat_map(|case| {
                let whole = (case.name.as_str(), false, case.episodes, case.successes, &case.misses);
                let parts =
                    case.splits.iter().map(|s| (s.of.as_str(), true, s.episodes, s.successes, &s.misses));
                let is_told = |&(_, _, all, obeyed, _): &Counted<'_>| not_obeyed(all, obeyed) > WORTH_TELLING;
                [whole].into_iter().chain(parts.filter(is_told))
            })
            .collect();
        let is_lacked =
            |name: &&str| counted.iter().any(|(.., misses)| misses.iter().any(|miss| miss.of == *name));
        let criteria: Vec<&str> = Criterion::ALL.map(Criterion::name).into_iter().filter(is_lacked).collect();
        let rows = counted.iter().map(|&(name, is_part, all, obeyed, misses)| {
            let of = |name: &&str| misses.iter().find(|miss| miss.of == *name);
            let share = |miss: &Miss| miss.episodes as f64 / all.max(1) as f64;
            let lacking = criteria.iter().map(|name| of(name).map(share)).collect();
            MissedRow { name, is_part, not_obeyed: not_obeyed(all, obeyed), lacking }
        });
        let rows = rows.collect();
        (!criteria.is_empty()).then_some(MissedTable { criteria, rows })
    }
}

/// Name, whether it is part of the case above, episodes, how many obeyed, what the others lack.
type Counted<'a> = (&'a str, bool, usize, usize, &'a Vec<Miss>);

fn not_obeyed(episodes: usize, obeyed: usize) -> f64 {
    episodes.saturating_sub(obeyed) as f64 / episodes.max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{measures::split::Split, results::CaseResult};

    #[test]
    fn cases_that_miss_nothing_and_grounds_that_seldom_do_are_left_out() {
        let miss = |of: &str, episodes| Miss { of: of.into(), episodes };
        let split = |of: &str, episodes, misses| Split { of: of.into(), episodes, successes: 19, misses };
        let case = |name: &str, obeyed, misses, splits| CaseResult {
            name: name.into(),
            misses,
            splits,
            ..CaseResult::from_counts(50, obeyed, 0)
        };
        let boxes = split("boxes", 25, vec![miss("place", 4), miss("yaw rate", 5)]);
        let slopes = split("slope up", 21, vec![miss("yaw rate", 2)]);
        let spin = case("-100/50", 40, vec![miss("place", 4), miss("yaw rate", 8)], vec![boxes, slopes]);
        let stop = case("-60/0", 48, vec![miss("place", 2)], vec![]);
        let results =
            Results { cases: vec![case("0/0", 50, vec![], vec![]), spin, stop], ..Results::default() };
        let table = results.missed().unwrap();
        assert_eq!(table.criteria, ["place", "yaw rate"]);
        let rows: Vec<_> = table.rows.iter().map(|row| (row.name, row.is_part, row.not_obeyed)).collect();
        assert_eq!(rows, [("-100/50", false, 0.2), ("boxes", true, 0.24), ("-60/0", false, 0.04)]);
        assert_eq!(table.rows[1].lacking, [Some(0.16), Some(0.2)]);
        assert_eq!(table.rows[2].lacking, [Some(0.04), None]);
        assert!(Results::default().missed().is_none());
    }
}
