//! The numbers of a training's iterations, as many as a page can draw.

/// Most rows that are kept; beyond that every other one is dropped.
const MAX_ROWS: usize = 2000;

/// Named numbers by iteration, thinned when they grow long.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Curves {
    names: Vec<String>,
    /// Iteration, then a number for each name; NaN where there is none.
    rows: Vec<Vec<f64>>,
    /// Grows when rows given out before are no longer true.
    edition: u64,
}

impl Curves {
    /// Adds the numbers of an iteration.
    pub fn append(&mut self, iteration: u64, values: &[(String, f64)]) {
        for (name, _) in values {
            if !self.names.contains(name) {
                self.names.push(name.clone());
                self.rows.iter_mut().for_each(|row| row.push(f64::NAN));
                self.edition += 1;
            }
        }
        let mut row = vec![f64::NAN; self.names.len() + 1];
        row[0] = iteration as f64;
        for (name, value) in values {
            if let Some(at) = self.names.iter().position(|known| known == name) {
                row[at + 1] = *value;
            }
        }
        self.rows.push(row);
        if self.rows.len() > MAX_ROWS {
            let mut index = 0;
            // The newest row stays.
            self.rows.retain(|_| {
                index += 1;
                index % 2 == 1
            });
            self.edition += 1;
        }
    }

    /// What is new since `seen` (edition, rows) as a message to the page, if anything is; `seen` is brought up to date.
    pub(super) fn news(&self, seen: &mut (u64, usize)) -> Option<String> {
        let now = (self.edition, self.rows.len());
        if *seen == now {
            return None;
        }
        let from = if seen.0 == self.edition { seen.1 } else { 0 };
        *seen = now;
        // serde_json writes what is no number as null.
        let message = serde_json::json!({
            "kind": "curves", "names": self.names, "from": from, "rows": self.rows[from..],
        });
        Some(message.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(name: &str, value: f64) -> Vec<(String, f64)> {
        vec![(name.to_owned(), value)]
    }

    fn told(curves: &Curves, seen: &mut (u64, usize)) -> Option<serde_json::Value> {
        curves.news(seen).map(|text| serde_json::from_str(&text).unwrap())
    }

    #[test]
    fn only_what_is_new_is_told_and_all_of_it_when_a_name_comes_late() {
        let mut curves = Curves::default();
        let mut seen = (0, 0);
        assert_eq!(told(&curves, &mut seen), None);
        curves.append(1, &row("reward", 0.5));
        assert_eq!(told(&curves, &mut seen).unwrap()["rows"], serde_json::json!([[1.0, 0.5]]));
        curves.append(2, &row("reward", f64::NAN));
        let news = told(&curves, &mut seen).unwrap();
        assert_eq!((news["from"].as_u64(), &news["rows"]), (Some(1), &serde_json::json!([[2.0, null]])));
        curves.append(3, &row("falls", 7.0));
        let news = told(&curves, &mut seen).unwrap();
        assert_eq!(news["names"], serde_json::json!(["reward", "falls"]));
        assert_eq!(news["rows"], serde_json::json!([[1.0, 0.5, null], [2.0, null, null], [3.0, null, 7.0]]));
        assert_eq!(told(&curves, &mut seen), None);
    }

    #[test]
    fn long_curves_are_thinned_and_keep_their_ends() {
        let mut curves = Curves::default();
        for iteration in 1..=9001 {
            curves.append(iteration, &row("reward", iteration as f64));
            assert!(curves.rows.len() <= MAX_ROWS);
            assert_eq!(curves.rows.last().unwrap()[0], iteration as f64);
        }
        assert_eq!(curves.rows[0][0], 1.0);
        assert!(curves.rows.windows(2).all(|pair| pair[0][0] < pair[1][0]));
    }
}
