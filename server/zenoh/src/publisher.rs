//! The publisher: a thread that reads the newest state at its own rate and puts it on Zenoh's keys.

use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use taut_observers::lines::{Naming, state_line};
use taut_observers::{EventLines, Hello, StateFeed};
use taut_proto::SceneDescription;
use taut_proto::codec::encode_onto;
use zenoh::bytes::Encoding;
use zenoh::pubsub::Publisher;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::{Session, Wait};

use crate::ros::{RosSettings, RosTopics};
use crate::routers::{Routers, client_config, sleep_until};

/// How the publisher is set up.
#[derive(Clone, Debug)]
pub struct ZenohSettings {
    /// Name of the workbench among the keys.
    pub name: String,
    /// Routers to dial, such as `tcp/router.example:7447`.
    pub connect: Vec<String>,
    /// Zenoh's own configuration, JSON5.
    pub config: Option<PathBuf>,
    /// States per second, at most.
    pub rate: f64,
    /// What the device port's events are called.
    pub naming: Naming,
    /// Also as a node of ROS 2.
    pub ros: Option<RosSettings>,
}

/// Why nothing can be published.
#[derive(Debug, thiserror::Error)]
pub enum ZenohError {
    /// Zenoh's configuration.
    #[error("[zenoh] cannot be used: {0}; check `connect` and the file of `config`")]
    Config(String),
    /// Routers that prove nobody, where forces would come from.
    #[error(
        "[wrench_in] would take forces from the router {0}, which proves nobody; use tls/ with root_ca_certificate and connect_private_key in the file of `config` in [zenoh], or a router on this machine, or write allow_unproven = true in [wrench_in]"
    )]
    Unproven(String),
    /// The thread.
    #[error("the thread of [zenoh] cannot be started: {0}")]
    Thread(#[from] io::Error),
}

/// A running publisher. Dropped, it ends.
#[derive(Debug)]
pub struct ZenohPublisher {
    prefix: String,
    ros_namespace: Option<String>,
    published: Arc<AtomicU64>,
    _thread: Routers,
}

impl ZenohPublisher {
    /// Checks the configuration and starts to publish what `feed` has. A router that is not there yet is waited for.
    ///
    /// # Errors
    /// [`ZenohError`].
    pub fn start(
        settings: ZenohSettings,
        hello: &Hello,
        feed: StateFeed,
    ) -> Result<Self, ZenohError> {
        let config = client_config(&settings.connect, settings.config.as_deref())?;
        let prefix = format!("taut/{}", settings.name);
        let ros_namespace = settings.ros.map(|_| format!("/{}", settings.name));
        let published = Arc::<AtomicU64>::default();
        let mut work = Work {
            prefix: prefix.clone(),
            hello: hello.line(),
            ros: settings
                .ros
                .map(|ros| (ros, settings.name, hello.scene.clone())),
            period: Duration::from_secs_f64(settings.rate.recip()),
            trail: EventLines::new(settings.naming),
            published: published.clone(),
        };
        let thread = Routers::reach("zenoh", config, move |session, stop| {
            if let Err(error) = work.publish(session, feed, stop) {
                tracing::error!("[zenoh] ended: {error}");
            }
        })?;
        Ok(Self {
            prefix,
            ros_namespace,
            published,
            _thread: thread,
        })
    }

    /// What all keys begin with.
    #[must_use]
    pub fn prefix(&self) -> &str {
        &self.prefix
    }

    /// What the names of its topics of ROS 2 begin with, if it has any.
    #[must_use]
    pub fn ros_namespace(&self) -> Option<&str> {
        self.ros_namespace.as_deref()
    }

    /// States handed to Zenoh so far.
    #[must_use]
    pub fn published(&self) -> u64 {
        self.published.load(Ordering::Relaxed)
    }
}

struct Work {
    prefix: String,
    hello: String,
    ros: Option<(RosSettings, String, SceneDescription)>,
    period: Duration,
    trail: EventLines,
    published: Arc<AtomicU64>,
}

impl Work {
    fn publish(
        &mut self,
        session: &Session,
        mut feed: StateFeed,
        stop: &AtomicBool,
    ) -> zenoh::Result<()> {
        let key = |name: &str| format!("{}/{name}", self.prefix);
        let newest_wins = |name: &str, encoding: Encoding| {
            session
                .declare_publisher(key(name))
                .encoding(encoding)
                .congestion_control(CongestionControl::Drop)
                .priority(Priority::RealTime)
                .express(true)
                .wait()
        };
        let states: Publisher<'_> = newest_wins("state", Encoding::APPLICATION_JSON)?;
        let hot: Publisher<'_> = newest_wins("hot", Encoding::APPLICATION_OCTET_STREAM)?;
        let events: Publisher<'_> = session
            .declare_publisher(key("event"))
            .encoding(Encoding::APPLICATION_JSON)
            .congestion_control(CongestionControl::Block)
            .priority(Priority::InteractiveHigh)
            .express(true)
            .wait()?;
        // Those who come later ask for it.
        let (answer, answered_key) = (self.hello.clone(), key("hello"));
        let hello_key = answered_key.clone();
        let _queryable = session
            .declare_queryable(answered_key)
            .callback(move |query| {
                let reply = query.reply(hello_key.clone(), answer.clone());
                // Whoever asked may be gone.
                let _ = reply.encoding(Encoding::APPLICATION_JSON).wait();
            })
            .wait()?;
        session
            .put(key("hello"), self.hello.clone())
            .encoding(Encoding::APPLICATION_JSON)
            .congestion_control(CongestionControl::Block)
            .wait()?;

        let ros = self.ros.as_ref();
        let ros =
            ros.map(|(settings, name, scene)| RosTopics::new(session, name, scene, *settings));
        let mut ros = ros.transpose()?;
        let mut payload = Vec::new();
        let mut deadline = Instant::now();
        while !stop.load(Ordering::Relaxed) {
            if let Some(fresh) = feed.fresh() {
                let state = fresh.state;
                for line in self.trail.take(fresh) {
                    events.put(line).wait()?;
                }
                states.put(state_line(state)).wait()?;
                payload.clear();
                // A state that cannot be encoded is not sent to render clients either, and counted there.
                if encode_onto(state, &mut payload).is_ok() {
                    hot.put(payload.as_slice()).wait()?;
                }
                if let Some(ros) = &mut ros {
                    ros.publish(state)?;
                }
                self.published.fetch_add(1, Ordering::Relaxed);
            }
            // Late ones are given up, not made up for.
            deadline = (deadline + self.period).max(Instant::now());
            sleep_until(deadline, stop);
        }
        Ok(())
    }
}
