//! Saving and loading state with one piece of code: each type lists its fields once, to a writer or a reader.

/// Something that visits every number of a state in a fixed order.
pub trait Archive {
    /// Visits a real number.
    fn f32(&mut self, value: &mut f32);
    /// Visits a whole number.
    fn u32(&mut self, value: &mut u32);

    /// Visits real numbers.
    fn f32s(&mut self, values: &mut [f32]) {
        values.iter_mut().for_each(|value| self.f32(value));
    }
    /// Visits an index or count below 2³².
    fn index(&mut self, value: &mut usize) {
        let mut word = *value as u32;
        self.u32(&mut word);
        *value = word as usize;
    }
    /// Visits a truth value.
    fn flag(&mut self, value: &mut bool) {
        let mut word = u32::from(*value);
        self.u32(&mut word);
        *value = word != 0;
    }
}

/// A state all of whose numbers an [`Archive`] can visit.
pub trait Archived {
    /// Visits every number.
    fn visit(&mut self, archive: &mut impl Archive);
}

/// Appends to bytes, little-endian.
pub struct Writer<'a>(pub &'a mut Vec<u8>);

impl Archive for Writer<'_> {
    fn f32(&mut self, value: &mut f32) {
        self.0.extend(value.to_le_bytes());
    }
    fn u32(&mut self, value: &mut u32) {
        self.0.extend(value.to_le_bytes());
    }
}

/// Takes from bytes; once they run out, numbers stay as they are and [`Reader::finish`] says so.
pub struct Reader<'a> {
    rest: &'a [u8],
    missing: usize,
}

impl<'a> Reader<'a> {
    /// A reader of all of `bytes`.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes, missing: 0 }
    }

    fn word(&mut self) -> Option<[u8; 4]> {
        let Some((word, rest)) = self.rest.split_first_chunk() else {
            self.missing += 4;
            return None;
        };
        self.rest = rest;
        Some(*word)
    }

    /// Checks that the bytes were neither too few nor too many.
    ///
    /// # Errors
    /// Says how many there were too few or too many.
    pub fn finish(self) -> Result<(), String> {
        match (self.missing, self.rest.len()) {
            (0, 0) => Ok(()),
            (0, left) => Err(format!("{left} bytes too many")),
            (missing, _) => Err(format!("{missing} bytes too few")),
        }
    }
}

impl Archive for Reader<'_> {
    fn f32(&mut self, value: &mut f32) {
        if let Some(word) = self.word() {
            *value = f32::from_le_bytes(word);
        }
    }
    fn u32(&mut self, value: &mut u32) {
        if let Some(word) = self.word() {
            *value = u32::from_le_bytes(word);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Sample(f32, usize, bool);
    impl Archived for Sample {
        fn visit(&mut self, archive: &mut impl Archive) {
            archive.f32(&mut self.0);
            archive.index(&mut self.1);
            archive.flag(&mut self.2);
        }
    }

    #[test]
    fn what_is_written_is_read_and_lengths_are_checked() {
        let mut bytes = Vec::new();
        Sample(-1.5, 7, true).visit(&mut Writer(&mut bytes));
        let mut copy = Sample(0.0, 0, false);
        let mut reader = Reader::new(&bytes);
        copy.visit(&mut reader);
        reader.finish().unwrap();
        assert!(copy.0 == -1.5 && copy.1 == 7 && copy.2);
        let mut reader = Reader::new(&bytes[..8]);
        copy.visit(&mut reader);
        assert_eq!(reader.finish().unwrap_err(), "4 bytes too few");
        bytes.push(0);
        let mut reader = Reader::new(&bytes);
        copy.visit(&mut reader);
        assert_eq!(reader.finish().unwrap_err(), "1 bytes too many");
    }
}
