//! An export, read back by the crates `mcap` and `cdr-encoding`.

use std::collections::BTreeMap;
use std::path::Path;

use byteorder::LittleEndian;
use mcap::MessageStream;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use taut_recording::{ExportReport, Recording, SceneFrames, export_mcap};

#[derive(Debug, Deserialize)]
pub(crate) struct Header {
    pub(crate) sec: i32,
    pub(crate) nanosec: u32,
    pub(crate) frame: String,
}

/// Header, then position and orientation x y z w.
#[derive(Debug, Deserialize)]
pub(crate) struct PoseStamped(pub(crate) Header, pub(crate) [f64; 7]);
/// Header, then six numbers: of a wrench or of a twist.
#[derive(Debug, Deserialize)]
pub(crate) struct SixStamped(pub(crate) Header, pub(crate) [f64; 6]);
#[derive(Debug, Deserialize)]
pub(crate) struct Joy(pub(crate) Header, pub(crate) Vec<f32>, pub(crate) Vec<i32>);
#[derive(Debug, Deserialize)]
pub(crate) struct Transform(pub(crate) Header, pub(crate) String, pub(crate) [f64; 7]);
#[derive(Debug, Deserialize)]
pub(crate) struct TfMessage(pub(crate) Vec<Transform>);

/// Log time and bytes of each message, by topic; and all log times in the order of the file.
pub(crate) struct Export {
    pub(crate) report: ExportReport,
    pub(crate) topics: BTreeMap<String, Vec<(u64, Vec<u8>)>>,
    pub(crate) times: Vec<u64>,
    pub(crate) bytes: Vec<u8>,
}

impl Export {
    pub(crate) fn read<T: DeserializeOwned>(&self, topic: &str) -> Vec<(u64, T)> {
        let Some(messages) = self.topics.get(topic) else {
            panic!("{topic} is not among {:?}", self.topics.keys());
        };
        let read = |(time, bytes): &(u64, Vec<u8>)| {
            assert_eq!(bytes[..4], [0, 1, 0, 0], "plain CDR, little-endian");
            match cdr_encoding::from_bytes::<T, LittleEndian>(&bytes[4..]) {
                Ok((message, length)) => {
                    assert_eq!(length + 4, bytes.len(), "{topic} has bytes left");
                    (*time, message)
                }
                Err(error) => panic!("{topic}: {error}"),
            }
        };
        messages.iter().map(read).collect()
    }

    pub(crate) fn left_out(&self) -> String {
        self.report.left_out.join("\n")
    }
}

pub(crate) fn export(directory: &Path, scene: Result<&SceneFrames, String>) -> Export {
    let recording = Recording::open(directory).unwrap_or_else(|error| panic!("{error}"));
    let mut bytes = Vec::new();
    let report = match export_mcap(&recording, scene, &mut bytes, || false) {
        Ok(report) => report,
        Err(error) => panic!("{error}"),
    };
    let (mut topics, mut times) = (BTreeMap::<_, Vec<_>>::new(), Vec::new());
    let stream = MessageStream::new(&bytes).expect("no MCAP");
    for message in stream {
        let message = message.expect("a message that is none");
        assert_eq!(message.channel.message_encoding, "cdr");
        times.push(message.log_time);
        let topic = topics.entry(message.channel.topic.clone()).or_default();
        topic.push((message.log_time, message.data.into_owned()));
    }
    assert_eq!(times.len() as u64, report.messages);
    Export {
        report,
        topics,
        times,
        bytes,
    }
}
