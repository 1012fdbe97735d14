//! Configuration in layers: defaults, then a TOML file, then `--set key=value`, then validation.
//!
//! A key that is not among the defaults is refused with the nearest one that is, so a typing mistake never trains
//! for an hour unnoticed.

use std::fs;
use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;
use toml::{Table, Value};

use crate::error::{BadInput, OrBadInput as _};

/// Lays `file` and then `overrides` (each `key.sub=value`) over the defaults of `T`.
///
/// # Errors
/// [`BadInput`] names the file or flag, the key and what is allowed there. Ranges are not checked here: that is
/// for the caller, with the `validate` of whatever `T` is made of.
pub fn resolve<T>(file: Option<&Path>, overrides: &[String]) -> Result<T, BadInput>
where
    T: Default + Serialize + DeserializeOwned,
{
    let text = match file {
        Some(path) => fs::read_to_string(path).or_bad_input(|| path.display().to_string())?,
        None => String::new(),
    };
    let source = file.map_or(String::from("defaults"), |path| path.display().to_string());
    resolve_text(&source, &text, overrides)
}

/// As [`resolve`], for TOML text at hand; `source` names it in errors.
///
/// # Errors
/// As [`resolve`].
pub fn resolve_text<T>(source: &str, text: &str, overrides: &[String]) -> Result<T, BadInput>
where
    T: Default + Serialize + DeserializeOwned,
{
    let known = Table::try_from(T::default()).or_bad_input(|| "defaults".into())?;
    let mut layers = vec![(source.to_owned(), text.parse::<Table>().or_bad_input(|| source.to_owned())?)];
    for assignment in overrides {
        layers.push((format!("--set {assignment}"), parse_assignment(assignment)?));
    }
    let mut resolved = known.clone();
    for (source, layer) in layers {
        merge(&mut resolved, layer, "", &known).map_err(|e| BadInput::new(format!("{source}: {e}")))?;
        // After every layer, so that an error is told of the layer which made it.
        T::deserialize(resolved.clone()).or_bad_input(|| source)?;
    }
    T::deserialize(resolved).or_bad_input(|| source.to_owned())
}

/// `a.b=1.5` as the table `{a = {b = 1.5}}`. A value that is not TOML is taken as a string: `ground=flat`.
fn parse_assignment(assignment: &str) -> Result<Table, BadInput> {
    let (path, text) = assignment
        .split_once('=')
        .filter(|(path, _)| path.split('.').all(|key| !key.trim().is_empty()))
        .ok_or_else(|| BadInput::new(format!("--set {assignment}: must be key.sub=value")))?;
    let mut value = format!("value = {text}")
        .parse::<Table>()
        .ok()
        .and_then(|mut table| table.remove("value"))
        .unwrap_or_else(|| Value::String(text.trim().into()));
    let mut keys: Vec<&str> = path.split('.').map(str::trim).collect();
    let first = keys.remove(0);
    for key in keys.into_iter().rev() {
        value = Value::Table(Table::from_iter([(key.to_owned(), value)]));
    }
    Ok(Table::from_iter([(first.to_owned(), value)]))
}

fn merge(base: &mut Table, layer: Table, path: &str, known: &Table) -> Result<(), String> {
    for (key, value) in layer {
        let key_path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
        match (base.get_mut(&key), value) {
            (None, _) => return Err(unknown_key(&key_path, known)),
            (Some(Value::Table(inner)), Value::Table(value)) => merge(inner, value, &key_path, known)?,
            (Some(Value::Table(_)), value) => {
                return Err(format!("{key_path} is {value}, but it is a section: set one of its keys"));
            }
            (Some(slot), value) => *slot = value,
        }
    }
    Ok(())
}

fn unknown_key(path: &str, known: &Table) -> String {
    let mut paths = Vec::new();
    key_paths(known, "", &mut paths);
    let last = |path: &str| path.rsplit('.').next().unwrap_or_default().to_owned();
    // The whole path decides; a key given without its section is found by its last part.
    let distance = |candidate: &String| {
        let whole = edit_distance(path, candidate);
        let tail = edit_distance(&last(path), &last(candidate));
        (whole.min(tail + 1), whole)
    };
    let nearest = paths.iter().min_by_key(|candidate| distance(candidate));
    match nearest {
        Some(nearest) => format!("unknown key {path:?}; the nearest known key is {nearest:?}"),
        None => format!("unknown key {path:?}"),
    }
}

/// Dotted paths of all sections and values of a table.
fn key_paths(table: &Table, prefix: &str, out: &mut Vec<String>) {
    for (key, value) in table {
        let path = if prefix.is_empty() { key.clone() } else { format!("{prefix}.{key}") };
        if let Value::Table(inner) = value {
            key_paths(inner, &path, out);
        }
        out.push(path);
    }
}

/// Levenshtein distance: insertions, deletions and substitutions that turn one word into the other.
fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, from) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, to) in b.iter().enumerate() {
            let substituted = diagonal + usize::from(from != *to);
            diagonal = row[j + 1];
            row[j + 1] = substituted.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Sample {
        seed: u64,
        ground: String,
        ppo: Ppo,
    }

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Ppo {
        clip_range: f64,
        hidden: Vec<usize>,
    }

    impl Default for Sample {
        fn default() -> Self {
            Self { seed: 1, ground: "rough".into(), ppo: Ppo { clip_range: 0.2, hidden: vec![512, 256] } }
        }
    }

    fn resolved(text: &str, overrides: &[&str]) -> Result<Sample, String> {
        let overrides: Vec<String> = overrides.iter().map(|s| s.to_string()).collect();
        resolve_text("a.toml", text, &overrides).map_err(|e| e.to_string())
    }

    #[test]
    fn later_layers_win_and_leave_the_rest() {
        let sample = resolved(
            "seed = 2\n[ppo]\nclip_range = 0.1",
            &["ppo.clip_range=1", "ground=flat", "ppo.hidden=[64, 32]"],
        )
        .unwrap();
        let ppo = Ppo { clip_range: 1.0, hidden: vec![64, 32] };
        assert_eq!(sample, Sample { seed: 2, ground: "flat".into(), ppo });
        assert_eq!(resolved("", &[]).unwrap(), Sample::default());
    }

    #[test]
    fn an_unknown_key_is_refused_with_its_path_and_the_nearest_known() {
        let message = resolved("[ppo]\nclip_rnge = 0.1", &[]).unwrap_err();
        assert_eq!(
            message,
            r#"a.toml: unknown key "ppo.clip_rnge"; the nearest known key is "ppo.clip_range""#
        );
        let message = resolved("", &["clip_range=0.1"]).unwrap_err();
        assert!(message.ends_with(r#"the nearest known key is "ppo.clip_range""#), "{message}");
    }

    #[test]
    fn a_value_of_the_wrong_kind_names_the_flag_and_the_key() {
        let message = resolved("", &["ppo.clip_range=wide"]).unwrap_err();
        assert!(
            message.starts_with("--set ppo.clip_range=wide") && message.contains("expected f64"),
            "{message}"
        );
        assert!(resolved("", &["ppo=3"]).unwrap_err().contains("ppo is 3, but it is a section"));
        for nonsense in ["seed", "=3", "ppo.=3"] {
            assert!(resolved("", &[nonsense]).unwrap_err().contains("must be key.sub=value"), "{nonsense}");
        }
    }

    #[test]
    fn edit_distance_of_textbook_words() {
        assert_eq!(edit_distance("kitten", "sitting"), 3);
        assert_eq!(edit_distance("", "abc"), 3);
        assert_eq!(edit_distance("same", "same"), 0);
    }
}
