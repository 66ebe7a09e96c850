//! What observers are told: the scene, what comes, then the past, its newest first.
//!
//! rerun's own store counts the bytes of messages and keeps the buffers that they came in, 3.5 times as much, and waits for its slowest observer.
//! This one counts what it holds; each observer reads it at a pace of its own, by its number, so that nobody waits for anybody.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use futures_util::stream::{Stream, unfold};
use re_protos::common::v1alpha1::StoreKind;
use re_protos::log_msg::v1alpha1::LogMsg;
use re_protos::log_msg::v1alpha1::log_msg::Msg;
use rerun::external::re_byte_size::SizeBytes as _;
use tokio::sync::watch;

/// An observer that is further behind goes on with the newest: some seconds.
const MOST_MESSAGES_BEHIND: u64 = 1024;
/// Of a message beside its own bytes: four allocations, two counts, a place in the queue.
const BESIDE_A_MESSAGE: u64 = 144;

/// The messages of a session: the scene's for ever, the others up to a limit.
#[derive(Debug)]
pub(crate) struct History {
    kept: Mutex<Kept>,
    limit_bytes: u64,
    skipped: Arc<AtomicU64>,
}

#[derive(Debug, Default)]
struct Kept {
    /// Layout, meshes, styles: each sent once.
    scene: Vec<Arc<LogMsg>>,
    past: VecDeque<Arc<LogMsg>>,
    /// Number of the first of `past`.
    begin: u64,
    past_bytes: u64,
}

impl Kept {
    fn end(&self) -> u64 {
        self.begin + self.past.len() as u64
    }

    fn message(&self, number: u64) -> Option<Arc<LogMsg>> {
        let place = number.checked_sub(self.begin)?;
        self.past.get(usize::try_from(place).ok()?).cloned()
    }
}

impl History {
    /// Keeps at most so many bytes of the past; `skipped` counts the messages that observers who were too slow did not get.
    pub(crate) fn new(limit_bytes: u64, skipped: Arc<AtomicU64>) -> Arc<History> {
        Arc::new(History {
            kept: Mutex::default(),
            limit_bytes,
            skipped,
        })
    }

    /// Adds a message; the oldest ones go. Never waits for an observer.
    pub(crate) fn add(&self, mut message: LogMsg) {
        if let Some(Msg::ArrowMsg(arrow)) = &mut message.msg {
            arrow.payload = arrow.payload.to_vec().into(); // no more than its bytes
        }
        let passes = passes(&message);
        let bytes = held_bytes(&message);
        let message = Arc::new(message);
        let kept = &mut *self.kept();
        if !passes {
            kept.scene.push(message);
            return;
        }
        kept.past.push_back(message);
        kept.past_bytes += bytes;
        while kept.past_bytes > self.limit_bytes
            && let Some(oldest) = kept.past.pop_front()
        {
            kept.past_bytes -= held_bytes(&oldest);
            kept.begin += 1;
        }
    }

    /// All that an observer who joins now is told. `grown` says when there is more, and ends with the session.
    pub(crate) fn observe(
        self: &Arc<History>,
        grown: watch::Receiver<()>,
    ) -> impl Stream<Item = LogMsg> + Send + use<> {
        let joined = self.kept().end();
        let observer = Observer {
            history: Arc::clone(self),
            scene: 0,
            next: joined,
            past: joined,
        };
        unfold((observer, grown), async |(mut observer, mut grown)| {
            loop {
                if let Some(message) = observer.take() {
                    return Some((LogMsg::clone(&message), (observer, grown)));
                }
                grown.changed().await.ok()?;
            }
        })
    }

    fn kept(&self) -> MutexGuard<'_, Kept> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// How far an observer is.
struct Observer {
    history: Arc<History>,
    /// How many messages of the scene it has.
    scene: usize,
    /// Number of the next that comes.
    next: u64,
    /// All before this number it does not have yet.
    past: u64,
}

impl Observer {
    /// The next message for it, if there is one.
    fn take(&mut self) -> Option<Arc<LogMsg>> {
        let kept = self.history.kept();
        if let Some(message) = kept.scene.get(self.scene) {
            self.scene += 1;
            return Some(Arc::clone(message));
        }
        let end = kept.end();
        if self.next < kept.begin || end - self.next > MOST_MESSAGES_BEHIND {
            let newest = end - 1;
            self.history
                .skipped
                .fetch_add(newest - self.next, Ordering::Relaxed);
            self.next = newest;
        }
        if let Some(message) = kept.message(self.next) {
            self.next += 1;
            return Some(message);
        }
        let message = kept.message(self.past.checked_sub(1)?)?;
        self.past -= 1;
        Some(message)
    }
}

/// Whether a message tells of a moment, and not of the scene.
fn passes(message: &LogMsg) -> bool {
    match &message.msg {
        Some(Msg::ArrowMsg(arrow)) => {
            let store = arrow.store_id.as_ref();
            arrow.is_static != Some(true)
                && store.is_none_or(|store| store.kind() != StoreKind::Blueprint)
        }
        _ => false,
    }
}

/// What a message takes of the memory.
fn held_bytes(message: &LogMsg) -> u64 {
    message.total_size_bytes() + BESIDE_A_MESSAGE
}

#[cfg(test)]
mod tests {
    use super::*;
    use futures_util::{FutureExt as _, StreamExt as _};
    use re_log_encoding::ToTransport as _;
    use re_log_encoding::rrd::Compression;
    use re_protos::log_msg::v1alpha1::ArrowMsg;
    use rerun::log::ChunkBatcherConfig;
    use rerun::{Quaternion, RecordingStreamBuilder, Transform3D};

    const PLENTY: u64 = 1 << 30;

    fn message(number: u64, is_static: bool) -> LogMsg {
        LogMsg {
            msg: Some(Msg::ArrowMsg(ArrowMsg {
                uncompressed_size: number,
                is_static: Some(is_static),
                payload: vec![0; 100].into(),
                ..ArrowMsg::default()
            })),
        }
    }

    fn number(message: &LogMsg) -> u64 {
        match &message.msg {
            Some(Msg::ArrowMsg(arrow)) => arrow.uncompressed_size,
            other => panic!("{other:?}"),
        }
    }

    /// Numbers of all messages that are there for this observer.
    fn taken(stream: &mut (impl Stream<Item = LogMsg> + Unpin)) -> Vec<u64> {
        let ready = std::iter::from_fn(|| stream.next().now_or_never().flatten());
        ready.map(|message| number(&message)).collect()
    }

    #[test]
    fn who_joins_late_gets_the_scene_then_what_comes_then_the_past_from_its_end() {
        let history = History::new(PLENTY, Arc::default());
        let (grown, growth) = watch::channel(());
        for (is_static, numbers) in [(true, 1..3), (false, 10..13)] {
            numbers.for_each(|number| history.add(message(number, is_static)));
        }
        let mut observer = Box::pin(history.observe(growth));
        history.add(message(20, false));
        assert_eq!(taken(&mut observer), [1, 2, 20, 12, 11, 10]);
        assert_eq!(taken(&mut observer), [] as [u64; 0]);
        history.add(message(21, false));
        grown.send_replace(());
        assert_eq!(taken(&mut observer), [21]);
        drop(grown);
        assert_eq!(observer.next().now_or_never(), Some(None), "the end");
    }

    #[test]
    fn the_oldest_go_at_the_limit_and_the_scene_never() {
        let one = held_bytes(&message(0, false));
        let history = History::new(3 * one, Arc::default());
        history.add(message(1, true));
        (10..20).for_each(|number| history.add(message(number, false)));
        let (_grown, growth) = watch::channel(());
        let mut observer = Box::pin(history.observe(growth));
        assert_eq!(taken(&mut observer), [1, 19, 18, 17]);
    }

    #[test]
    fn an_observer_that_stalls_goes_on_with_the_newest_and_what_it_missed_is_counted() {
        let skipped = Arc::<AtomicU64>::default();
        let history = History::new(PLENTY, Arc::clone(&skipped));
        let (_grown, growth) = watch::channel(());
        let mut observer = Box::pin(history.observe(growth));
        let more = MOST_MESSAGES_BEHIND + 1;
        (0..more).for_each(|number| history.add(message(number, false)));
        assert_eq!(taken(&mut observer), [more - 1]);
        assert_eq!(skipped.load(Ordering::Relaxed), more - 1);
    }

    fn resident_bytes() -> u64 {
        let status = std::fs::read_to_string("/proc/self/status").unwrap();
        let line = status.lines().find(|line| line.starts_with("VmRSS:"));
        let kib = line.unwrap().split_whitespace().nth(1).unwrap();
        kib.parse::<u64>().unwrap() * 1024
    }

    /// Poses, one in a message, as pictures have them.
    fn poses() -> Vec<LogMsg> {
        let (stream, stored) = RecordingStreamBuilder::new("test")
            .batcher_config(ChunkBatcherConfig {
                flush_num_rows: 1,
                ..ChunkBatcherConfig::DEFAULT
            })
            .memory()
            .unwrap();
        for number in 0..100 {
            let t = number as f32;
            let turned = Quaternion::from_xyzw([t.sin(), 0.0, 0.0, t.cos()]);
            let pose = Transform3D::from_translation_rotation([t.sin(), t.cos(), 0.2], turned);
            stream.log("world/god_object", &pose).unwrap();
        }
        let encoded = |message: &rerun::log::LogMsg| {
            let message = message.to_transport(Compression::LZ4);
            message.expect("a message").into()
        };
        stored.take().iter().map(encoded).collect()
    }

    /// In rerun's own store this was 3.5 times its limit.
    #[test]
    fn the_memory_held_is_the_limit_of_the_history_and_a_little() {
        const LIMIT: u64 = 16 << 20;
        let poses = poses();
        assert!(poses.len() >= 100, "{}", poses.len());
        let history = History::new(LIMIT, Arc::default());
        let mut held = Vec::new();
        let before = resident_bytes();
        for _ in 0..8 {
            (0..60).for_each(|_| poses.iter().for_each(|pose| history.add(pose.clone())));
            held.push(resident_bytes().saturating_sub(before) >> 10);
        }
        let most = LIMIT >> 10;
        assert!(
            held[7] > most / 2,
            "the limit was not reached: {held:?} KiB"
        );
        assert!(held[7] < most * 5 / 4, "{held:?} KiB");
        assert!(
            held[7] < held[4] + most / 16,
            "it goes on growing: {held:?} KiB"
        );
    }
}
