//! TensorBoard event files: scalars and histograms over iterations, readable by TensorBoard's own loader.
//!
//! The file is a sequence of records; a record is a length and a serialized `Event`, each followed by its masked
//! CRC32C. Format: tensorflow/core/lib/io/record_writer.h and tensorflow/core/util/event.proto.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

/// The part of TensorFlow's `Event` that carries summaries.
#[derive(Clone, PartialEq, prost::Message)]
struct Event {
    #[prost(double, tag = "1")]
    wall_time: f64,
    #[prost(int64, tag = "2")]
    step: i64,
    #[prost(string, optional, tag = "3")]
    file_version: Option<String>,
    #[prost(message, optional, tag = "5")]
    summary: Option<Summary>,
    #[prost(message, optional, tag = "7")]
    session_log: Option<SessionLog>,
}

#[derive(Clone, PartialEq, prost::Message)]
struct Summary {
    #[prost(message, repeated, tag = "1")]
    value: Vec<Value>,
}

/// Both values are members of a oneof: as a plain field, a scalar of 0.0 would not be written at all.
#[derive(Clone, PartialEq, prost::Message)]
struct Value {
    #[prost(string, tag = "1")]
    tag: String,
    #[prost(float, optional, tag = "2")]
    simple_value: Option<f32>,
    #[prost(message, optional, tag = "5")]
    histo: Option<Histogram>,
}

/// TensorFlow's `HistogramProto`: counts between limits that rise, the last of them at or above the largest value.
#[derive(Clone, PartialEq, prost::Message)]
struct Histogram {
    #[prost(double, tag = "1")]
    min: f64,
    #[prost(double, tag = "2")]
    max: f64,
    #[prost(double, tag = "3")]
    num: f64,
    #[prost(double, tag = "4")]
    sum: f64,
    #[prost(double, tag = "5")]
    sum_squares: f64,
    #[prost(double, repeated, tag = "6")]
    bucket_limit: Vec<f64>,
    #[prost(double, repeated, tag = "7")]
    bucket: Vec<f64>,
}

/// Buckets of equal width between the extremes.
const BUCKETS: usize = 50;

impl Histogram {
    /// Of the values that are numbers; `None` if there is none.
    fn of(values: &[f32]) -> Option<Self> {
        let values = || values.iter().map(|&value| f64::from(value)).filter(|value| value.is_finite());
        let min = values().reduce(f64::min)?;
        let max = values().reduce(f64::max)?;
        let width = (max - min) / BUCKETS as f64;
        let limit = |i| if i + 1 == BUCKETS { max } else { min + width * (i + 1) as f64 };
        let mut bucket = vec![0.0; BUCKETS];
        for value in values() {
            // With one value only the width is 0, and the quotient no number, which becomes 0.
            bucket[(((value - min) / width) as usize).min(BUCKETS - 1)] += 1.0;
        }
        Some(Self {
            min,
            max,
            num: values().count() as f64,
            sum: values().sum(),
            sum_squares: values().map(|value| value * value).sum(),
            bucket_limit: (0..BUCKETS).map(limit).collect(),
            bucket,
        })
    }
}

#[derive(Clone, PartialEq, prost::Message)]
struct SessionLog {
    #[prost(int32, tag = "1")]
    status: i32,
}

const SESSION_START: i32 = 1;

/// Appends scalars to one event file.
#[derive(Debug)]
pub struct EventWriter<W: Write = BufWriter<File>> {
    out: W,
}

impl EventWriter {
    /// Begins a new event file in `folder`. A run continued at `first_step` hides the points which an interrupted
    /// run left beyond it.
    ///
    /// # Errors
    /// The file cannot be created or written.
    pub fn create(folder: &Path, first_step: u64) -> io::Result<Self> {
        let since_epoch = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let name = format!("events.out.tfevents.{}.{:09}", since_epoch.as_secs(), since_epoch.subsec_nanos());
        Self::begin(BufWriter::new(File::create_new(folder.join(name))?), first_step)
    }
}

impl<W: Write> EventWriter<W> {
    fn begin(out: W, first_step: u64) -> io::Result<Self> {
        let mut writer = Self { out };
        writer.record(&Event { file_version: Some("brain.Event:2".into()), ..event_at(0) })?;
        let session_log = Some(SessionLog { status: SESSION_START });
        writer.record(&Event { session_log, ..event_at(first_step) })?;
        writer.out.flush()?;
        Ok(writer)
    }

    /// Writes named scalars of one step and flushes them, so that a running TensorBoard sees them.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn scalars<'a>(
        &mut self,
        step: u64,
        values: impl IntoIterator<Item = (&'a str, f64)>,
    ) -> io::Result<()> {
        let value = values
            .into_iter()
            .map(|(tag, value)| Value { tag: tag.into(), simple_value: Some(value as f32), histo: None })
            .collect();
        self.record(&Event { summary: Some(Summary { value }), ..event_at(step) })?;
        self.out.flush()
    }

    /// Writes the distributions of named values at one step.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn histograms(&mut self, step: u64, values: &[(String, Vec<f32>)]) -> io::Result<()> {
        let value = values
            .iter()
            .filter_map(|(tag, values)| {
                let histo = Some(Histogram::of(values)?);
                Some(Value { tag: tag.clone(), simple_value: None, histo })
            })
            .collect();
        self.record(&Event { summary: Some(Summary { value }), ..event_at(step) })?;
        self.out.flush()
    }

    fn record(&mut self, event: &Event) -> io::Result<()> {
        let data = prost::Message::encode_to_vec(event);
        let length = (data.len() as u64).to_le_bytes();
        self.out.write_all(&length)?;
        self.out.write_all(&masked_crc(&length).to_le_bytes())?;
        self.out.write_all(&data)?;
        self.out.write_all(&masked_crc(&data).to_le_bytes())
    }
}

fn event_at(step: u64) -> Event {
    let wall_time = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs_f64();
    Event { wall_time, step: step as i64, ..Event::default() }
}

/// CRC32C rotated right by 15 bits plus a constant, so that a checksum of data that holds checksums stays useful.
/// tensorflow/core/lib/hash/crc32c.h.
fn masked_crc(data: &[u8]) -> u32 {
    crc32c::crc32c(data).rotate_right(15).wrapping_add(0xa282_ead8)
}

#[cfg(test)]
mod tests {
    use super::*;
    use prost::Message as _;

    fn read_records(mut bytes: &[u8]) -> Vec<Event> {
        let mut events = Vec::new();
        while !bytes.is_empty() {
            let length = u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
            let length_crc = u32::from_le_bytes(bytes[8..12].try_into().unwrap());
            assert_eq!(length_crc, masked_crc(&bytes[..8]));
            let data = &bytes[12..12 + length];
            let data_crc = u32::from_le_bytes(bytes[12 + length..16 + length].try_into().unwrap());
            assert_eq!(data_crc, masked_crc(data));
            events.push(Event::decode(data).unwrap());
            bytes = &bytes[16 + length..];
        }
        events
    }

    #[test]
    fn crc_matches_the_published_vector() {
        // RFC 3720 appendix B.4: CRC32C of 32 zero bytes is 0x8a9136aa; masked by hand.
        let mut masked = 0x8a91_36aa_u32;
        masked = masked.rotate_right(15);
        assert_eq!(masked_crc(&[0; 32]), masked.wrapping_add(0xa282_ead8));
    }

    #[test]
    fn a_histogram_counts_every_number_once() {
        let histogram = Histogram::of(&[0.0, 1.0, 1.0, -1.0, f32::NAN, 0.5]).unwrap();
        assert_eq!((histogram.min, histogram.max, histogram.num, histogram.sum), (-1.0, 1.0, 5.0, 1.5));
        assert_eq!(histogram.bucket.iter().sum::<f64>(), 5.0);
        assert_eq!((histogram.bucket[0], histogram.bucket[BUCKETS - 1]), (1.0, 2.0));
        assert_eq!(histogram.bucket_limit[BUCKETS - 1], 1.0);
        assert_eq!(Histogram::of(&[2.0, 2.0]).unwrap().bucket[0], 2.0);
        assert!(Histogram::of(&[f32::NAN]).is_none());
    }

    #[test]
    fn zero_survives_the_round_trip() {
        let mut bytes = Vec::new();
        let mut writer = EventWriter::begin(&mut bytes, 7).unwrap();
        writer.scalars(8, [("reward", 0.0), ("kl", 0.5)]).unwrap();
        let events = read_records(&bytes);
        assert_eq!(events.len(), 3);
        assert_eq!(events[0].file_version.as_deref(), Some("brain.Event:2"));
        assert_eq!((events[1].step, events[1].session_log.clone().unwrap().status), (7, SESSION_START));
        let values = &events[2].summary.as_ref().unwrap().value;
        assert_eq!(values[0].simple_value, Some(0.0));
        assert_eq!(values[1].simple_value, Some(0.5));
    }
}
