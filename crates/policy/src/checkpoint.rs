//! Checkpoints: named tensors and opaque state in one safetensors file, written so that a crash leaves the old one.

use std::{
    collections::{BTreeMap, HashMap},
    fs::{self, File},
    io::{self, Write as _},
    path::Path,
};

use safetensors::{Dtype, SafeTensors, tensor::TensorView};

/// Version of the file's layout; another one is refused.
const VERSION: &str = "1";
const VERSION_KEY: &str = "guidedog_checkpoint";

/// Everything a run needs to go on.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Checkpoint {
    /// Tensors by name: shape and numbers, row-major.
    pub tensors: BTreeMap<String, (Vec<usize>, Vec<f32>)>,
    /// Opaque state by name.
    pub bytes: BTreeMap<String, Vec<u8>>,
    /// Text by name: counters, configuration.
    pub header: BTreeMap<String, String>,
}

/// A checkpoint that cannot be written or read.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// The disk refuses.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: String,
        /// Why.
        source: io::Error,
    },
    /// The file is damaged.
    #[error("not a whole checkpoint: {0}")]
    Damaged(String),
    /// The file is of another version.
    #[error("checkpoint version is `{found}`, must be `{VERSION}`")]
    Version {
        /// Version found.
        found: String,
    },
    /// Something is not in the file.
    #[error("the checkpoint has no {what} `{name}`")]
    Missing {
        /// Kind of entry.
        what: &'static str,
        /// Its name.
        name: String,
    },
    /// A tensor is of another size.
    #[error("tensor `{name}` has {found} numbers, must have {allowed}")]
    Size {
        /// The tensor.
        name: String,
        /// Numbers found.
        found: usize,
        /// Numbers that fit.
        allowed: usize,
    },
}

impl Checkpoint {
    /// Adds a flat tensor.
    pub fn insert(&mut self, name: &str, values: &[f32]) {
        self.tensors.insert(name.to_owned(), (vec![values.len()], values.to_vec()));
    }

    /// Copies a tensor of the same size into `values`.
    ///
    /// # Errors
    /// The tensor is missing or of another size.
    pub fn read_into(&self, name: &str, values: &mut [f32]) -> Result<(), CheckpointError> {
        let Some((_, stored)) = self.tensors.get(name) else {
            return Err(CheckpointError::Missing { what: "tensor", name: name.to_owned() });
        };
        if stored.len() != values.len() {
            let (found, allowed) = (stored.len(), values.len());
            return Err(CheckpointError::Size { name: name.to_owned(), found, allowed });
        }
        values.copy_from_slice(stored);
        Ok(())
    }

    /// Opaque state by name.
    ///
    /// # Errors
    /// There is none of that name.
    pub fn state(&self, name: &str) -> Result<&[u8], CheckpointError> {
        let missing = || CheckpointError::Missing { what: "state", name: name.to_owned() };
        Ok(self.bytes.get(name).ok_or_else(missing)?)
    }

    /// A header entry read as `T`.
    ///
    /// # Errors
    /// The entry is missing or does not read as `T`.
    pub fn number<T: std::str::FromStr>(&self, name: &str) -> Result<T, CheckpointError> {
        let missing = || CheckpointError::Missing { what: "header entry", name: name.to_owned() };
        let text = self.header.get(name).ok_or_else(missing)?;
        text.parse().map_err(|_| CheckpointError::Damaged(format!("header `{name}` is `{text}`")))
    }

    /// The file's bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut numbers = Vec::new();
        for (name, (shape, values)) in &self.tensors {
            let raw: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
            numbers.push((format!("tensor/{name}"), Dtype::F32, shape.clone(), raw));
        }
        for (name, raw) in &self.bytes {
            numbers.push((format!("state/{name}"), Dtype::U8, vec![raw.len()], raw.clone()));
        }
        let views = numbers.iter().map(|(name, dtype, shape, raw)| {
            let view = TensorView::new(*dtype, shape.clone(), raw).expect("length matches the shape");
            (name.as_str(), view)
        });
        let mut metadata: HashMap<_, _> = self.header.clone().into_iter().collect();
        metadata.insert(VERSION_KEY.to_owned(), VERSION.to_owned());
        safetensors::serialize(views, Some(metadata)).expect("names are unique")
    }

    /// Reads a file's bytes.
    ///
    /// # Errors
    /// The file is damaged or of another version.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, CheckpointError> {
        let damaged = |error: safetensors::SafeTensorError| CheckpointError::Damaged(error.to_string());
        let (_, metadata) = SafeTensors::read_metadata(bytes).map_err(damaged)?;
        let mut header: BTreeMap<_, _> =
            metadata.metadata().clone().unwrap_or_default().into_iter().collect();
        let found = header.remove(VERSION_KEY).unwrap_or_else(|| "none".to_owned());
        if found != VERSION {
            return Err(CheckpointError::Version { found });
        }
        let file = SafeTensors::deserialize(bytes).map_err(damaged)?;
        let mut checkpoint = Self { header, ..Self::default() };
        for (name, view) in file.tensors() {
            if let Some(name) = name.strip_prefix("tensor/") {
                if view.dtype() != Dtype::F32 {
                    let found = format!("tensor `{name}` holds {:?}, must be F32", view.dtype());
                    return Err(CheckpointError::Damaged(found));
                }
                let numbers = view.data().chunks_exact(4);
                let numbers = numbers.map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
                checkpoint.tensors.insert(name.to_owned(), (view.shape().to_vec(), numbers));
            } else if let Some(name) = name.strip_prefix("state/") {
                checkpoint.bytes.insert(name.to_owned(), view.data().to_vec());
            }
        }
        Ok(checkpoint)
    }

    /// Writes the file; a crash at any moment leaves the previous one.
    ///
    /// # Errors
    /// The disk refuses.
    pub fn save(&self, path: &Path) -> Result<(), CheckpointError> {
        let io = |source| CheckpointError::Io { path: path.display().to_string(), source };
        write_atomic(path, &self.to_bytes()).map_err(io)
    }

    /// Reads the file.
    ///
    /// # Errors
    /// The file cannot be read, is damaged or of another version.
    pub fn load(path: &Path) -> Result<Self, CheckpointError> {
        let io = |source| CheckpointError::Io { path: path.display().to_string(), source };
        Self::from_bytes(&fs::read(path).map_err(io)?)
    }
}

/// Writes a file in one piece: to a temporary name beside it, to the disk, then renamed.
///
/// # Errors
/// The disk refuses; the previous file is untouched and the temporary one removed.
pub fn write_atomic(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut name = path.file_name().ok_or(io::ErrorKind::InvalidInput)?.to_owned();
    name.push(format!(".{}.tmp", std::process::id()));
    let temporary = path.with_file_name(name);
    let write = || -> io::Result<()> {
        let mut file = File::create(&temporary)?;
        file.write_all(bytes)?;
        file.sync_all()?;
        fs::rename(&temporary, path)?;
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        // The rename itself must survive a power cut too; not every system can sync a folder.
        let _ = File::open(folder.unwrap_or(Path::new("."))).and_then(|folder| folder.sync_all());
        Ok(())
    };
    write().inspect_err(|_| {
        let _ = fs::remove_file(&temporary);
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Checkpoint {
        let mut checkpoint = Checkpoint::default();
        checkpoint
            .tensors
            .insert("w".into(), (vec![2, 3], vec![1.0, -2.0, 0.5, 4.0, 5.0, f32::MIN_POSITIVE]));
        checkpoint.insert("b", &[1.0]);
        checkpoint.bytes.insert("environment".into(), (0..=255).collect());
        checkpoint.header.insert("iteration".into(), "17".into());
        checkpoint
    }

    #[test]
    fn what_is_saved_comes_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.safetensors");
        sample().save(&path).unwrap();
        assert_eq!(Checkpoint::load(&path).unwrap(), sample());
        assert_eq!(sample().number::<u32>("iteration").unwrap(), 17);
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1, "nothing temporary stays");
        assert!(sample().save(&folder.path().join("missing/a")).is_err());
    }

    #[test]
    fn a_file_cut_anywhere_is_refused() {
        let whole = sample().to_bytes();
        for end in 0..whole.len() {
            assert!(Checkpoint::from_bytes(&whole[..end]).is_err(), "cut at {end}");
        }
    }

    #[test]
    fn another_version_is_refused_by_name() {
        let text = String::from_utf8_lossy(&sample().to_bytes()).into_owned();
        assert!(text.contains(r#""guidedog_checkpoint":"1""#));
        let mut bytes = sample().to_bytes();
        let at = bytes.windows(3).position(|w| w == b"\"1\"").unwrap();
        bytes[at + 1] = b'9';
        let message = Checkpoint::from_bytes(&bytes).unwrap_err().to_string();
        assert!(message.contains("`9`"), "{message}");
    }

    #[test]
    fn numbers_of_another_type_are_refused_by_name() {
        let raw = [0_u8; 16];
        for (dtype, shape) in [(Dtype::F64, 2), (Dtype::F16, 8)] {
            let view = TensorView::new(dtype, vec![shape], &raw).unwrap();
            let version = HashMap::from([(VERSION_KEY.to_owned(), VERSION.to_owned())]);
            let bytes = safetensors::serialize([("tensor/samples", view)], Some(version)).unwrap();
            let message = Checkpoint::from_bytes(&bytes).unwrap_err().to_string();
            assert!(message.contains(&format!("`samples` holds {dtype:?}, must be F32")), "{message}");
        }
    }

    #[test]
    fn a_tensor_of_another_size_is_named() {
        let message = sample().read_into("w", &mut [0.0; 5]).unwrap_err().to_string();
        assert!(message.contains("`w`") && message.contains('6') && message.contains('5'), "{message}");
        assert!(sample().read_into("x", &mut []).unwrap_err().to_string().contains("`x`"));
    }
}
