//! `metrics.csv`: one row an iteration, appended as training goes and cut back when a run resumes.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// The first column of every table.
const ITERATION: &str = "iteration";

/// A table of named numbers over iterations, kept on disk as it grows.
#[derive(Debug)]
pub struct MetricsTable {
    path: PathBuf,
    columns: Vec<String>,
    rows: Vec<Vec<Option<f64>>>,
}

impl MetricsTable {
    /// Opens the table at `path` to go on with it, empty if there is none, and drops the rows after `last_iteration`: what
    /// an interrupted run wrote beyond its last checkpoint will be computed again. The caller holds the run's lock.
    ///
    /// # Errors
    /// As [`Self::read`], or the file cannot be written.
    pub fn open(path: &Path, last_iteration: u64) -> io::Result<Self> {
        let mut table = Self::read(path)?;
        let is_kept =
            |row: &&Vec<Option<f64>>| row[0].is_some_and(|iteration| iteration <= last_iteration as f64);
        let kept = table.rows.iter().take_while(is_kept).count();
        table.rows.truncate(kept);
        table.rewrite()?;
        Ok(table)
    }

    /// Reads the table at `path`, empty if there is none, and leaves the file as it is: another process may be writing it.
    ///
    /// # Errors
    /// The file cannot be read, or its first line is not a header that begins with `iteration`. A row that breaks off
    /// (the machine went down) and those after it are left out.
    pub fn read(path: &Path) -> io::Result<Self> {
        let text = match fs::read_to_string(path) {
            Ok(text) => text,
            Err(error) if error.kind() == io::ErrorKind::NotFound => String::new(),
            Err(error) => return Err(error),
        };
        let mut table = Self { path: path.into(), columns: vec![ITERATION.into()], rows: Vec::new() };
        // A line that breaks off may read as a whole one with shorter numbers.
        let mut lines = text.split_inclusive('\n').map_while(|line| line.strip_suffix('\n'));
        if let Some(header) = lines.next() {
            table.columns = header.split(',').map(str::to_owned).collect();
        }
        if table.columns[0] != ITERATION {
            let message = format!("first column is {:?}, must be {ITERATION:?}", table.columns[0]);
            return Err(io::Error::new(io::ErrorKind::InvalidData, message));
        }
        table.rows = lines.map_while(|line| parse_row(line, table.columns.len())).collect();
        Ok(table)
    }

    /// Adds the row of one iteration. A name not seen before becomes a new column, empty in earlier rows.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn append(&mut self, iteration: u64, values: &[(String, f64)]) -> io::Result<()> {
        let known = self.columns.len();
        for (name, _) in values {
            if !self.columns.contains(name) {
                self.columns.push(name.clone());
            }
        }
        let mut row = vec![None; self.columns.len()];
        row[0] = Some(iteration as f64);
        for (name, value) in values {
            let column = self.columns.iter().position(|c| c == name).expect("every name has a column by now");
            row[column] = Some(*value);
        }
        self.rows.push(row);
        if self.columns.len() > known { self.rewrite() } else { self.append_last_row() }
    }

    /// Waits until all rows are on the disk.
    ///
    /// # Errors
    /// The disk refuses.
    pub fn to_disk(&self) -> io::Result<()> {
        fs::File::open(&self.path)?.sync_all()
    }

    /// Names of all columns, the first of which is `iteration`.
    pub fn columns(&self) -> &[String] {
        &self.columns
    }

    /// The values of one column, with their iterations; empty if there is no such column.
    pub fn column(&self, name: &str) -> Vec<(u64, f64)> {
        let Some(column) = self.columns.iter().position(|c| c == name) else { return Vec::new() };
        self.rows
            .iter()
            .filter_map(|row| Some((row[0]? as u64, row.get(column).copied().flatten()?)))
            .collect()
    }

    /// All rows, oldest first: the iteration, and the values by name.
    pub fn rows(&self) -> impl Iterator<Item = (u64, Vec<(String, f64)>)> + '_ {
        self.rows.iter().filter_map(|row| {
            let named = self.columns.iter().zip(row).skip(1);
            let values = named.filter_map(|(name, value)| Some((name.clone(), (*value)?)));
            Some((row[0]? as u64, values.collect()))
        })
    }

    fn append_last_row(&self) -> io::Result<()> {
        use io::Write as _;
        let mut file = fs::OpenOptions::new().append(true).open(&self.path)?;
        self.rows.last().map_or(Ok(()), |row| file.write_all(format_row(row, self.columns.len()).as_bytes()))
    }

    fn rewrite(&self) -> io::Result<()> {
        let mut text = self.columns.join(",") + "\n";
        for row in &self.rows {
            text += &format_row(row, self.columns.len());
        }
        crate::run_folder::write_atomic(&self.path, text.as_bytes())
    }
}

fn format_row(row: &[Option<f64>], width: usize) -> String {
    let cells = (0..width).map(|i| row.get(i).copied().flatten().map_or(String::new(), |v| v.to_string()));
    cells.collect::<Vec<_>>().join(",") + "\n"
}

/// `None` if the line is not a whole row of `width` numbers or empty cells.
fn parse_row(line: &str, width: usize) -> Option<Vec<Option<f64>>> {
    let cells: Vec<&str> = line.split(',').collect();
    if cells.len() != width {
        return None;
    }
    cells.iter().map(|cell| if cell.is_empty() { Some(None) } else { cell.parse().ok().map(Some) }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(reward: f64) -> Vec<(String, f64)> {
        vec![("reward".into(), reward)]
    }

    #[test]
    fn resuming_drops_rows_after_the_checkpoint() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("metrics.csv");
        let mut table = MetricsTable::open(&path, 0).unwrap();
        for iteration in 1..=5 {
            table.append(iteration, &row(iteration as f64 / 3.0)).unwrap();
        }
        let mut resumed = MetricsTable::open(&path, 3).unwrap();
        resumed.append(4, &row(9.0)).unwrap();
        let expected = [(1, 1.0 / 3.0), (2, 2.0 / 3.0), (3, 1.0), (4, 9.0)];
        let table = MetricsTable::open(&path, u64::MAX).unwrap();
        assert_eq!(table.column("reward"), expected);
        assert!(table.rows().eq(expected.map(|(iteration, value)| (iteration, row(value)))));
    }

    #[test]
    fn a_broken_last_row_is_dropped_but_not_by_those_who_only_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("metrics.csv");
        for rest in ["2,0.", "2,0.5,0.1"] {
            let written = format!("iteration,reward,kl\n1,0.5,0.1\n{rest}");
            fs::write(&path, &written).unwrap();
            assert_eq!(MetricsTable::read(&path).unwrap().column("reward"), [(1, 0.5)]);
            assert_eq!(fs::read_to_string(&path).unwrap(), written);
        }
        assert_eq!(MetricsTable::open(&path, 9).unwrap().column("reward"), [(1, 0.5)]);
        assert_eq!(fs::read_to_string(&path).unwrap(), "iteration,reward,kl\n1,0.5,0.1\n");
    }

    #[test]
    fn a_new_name_becomes_a_column_empty_before() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("metrics.csv");
        let mut table = MetricsTable::open(&path, 0).unwrap();
        table.append(1, &row(0.5)).unwrap();
        table.append(2, &[("falls".into(), 3.0)]).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "iteration,reward,falls\n1,0.5,\n2,,3\n");
    }

    #[test]
    fn a_file_that_is_no_table_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("metrics.csv");
        fs::write(&path, "something else\n").unwrap();
        let message = MetricsTable::open(&path, 0).unwrap_err().to_string();
        assert_eq!(message, r#"first column is "something else", must be "iteration""#);
    }
}
