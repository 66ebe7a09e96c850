//! Those who look on without taut's own client: VRPN, JSON lines, Zenoh. Each reads the broadcaster's states on a thread of its
//! own; the broadcaster publishes and never waits.

use std::net::{SocketAddr, SocketAddrV4};

use taut_bridge::EventKind;
use taut_observers::{
    Hello, StateFeed, StateOutlet, StreamServer, StreamSettings, VrpnFrame, VrpnServer,
    VrpnSettings, state_channel,
};
use taut_proto::{HotState, SceneDescription};
use taut_scene::{ObserverStream, Vrpn, Workbench, Zenoh};

use crate::shared::clock::SessionClock;
use crate::shared::failure::Failure;

/// Who may look on, before anything is started.
#[derive(Clone, Debug, PartialEq)]
pub struct ObserverSettings {
    /// Name of the workbench.
    pub workbench: String,
    /// The VRPN server.
    pub vrpn: Vrpn,
    /// JSON lines.
    pub stream: ObserverStream,
    /// The stream's token, read from its file.
    pub token: Option<String>,
    /// Publication through Zenoh.
    pub zenoh: Zenoh,
}

/// What the broadcaster publishes to; nothing where nobody may look on.
#[derive(Debug, Default)]
pub struct Outlets(Vec<StateOutlet>);

/// Those who look on. Dropped, they end.
#[derive(Debug, Default)]
pub struct ObserverServices {
    vrpn: Option<VrpnServer>,
    stream: Option<StreamServer>,
    #[cfg(feature = "zenoh")]
    zenoh: Option<taut_zenoh::ZenohPublisher>,
}

impl ObserverSettings {
    /// What the workbench file wants.
    ///
    /// # Errors
    /// The token cannot be read, or the program was built without what is wanted.
    pub fn of(workbench: &Workbench) -> Result<Self, Failure> {
        if workbench.zenoh.enabled && !cfg!(feature = "zenoh") {
            return Err(Failure::bad_input(
                "the workbench file has [zenoh] enabled, but this program was built without it; build it with --features zenoh, or set zenoh.enabled = false",
            ));
        }
        Ok(Self {
            workbench: workbench.name.clone(),
            vrpn: workbench.vrpn.clone(),
            stream: workbench.observers.clone(),
            token: observers_token(workbench)?,
            zenoh: workbench.zenoh.clone(),
        })
    }
}

/// The token that the workbench file names for those who look on.
pub(crate) fn observers_token(workbench: &Workbench) -> Result<Option<String>, Failure> {
    let observers = &workbench.observers;
    let Some(file) = observers.token_file.as_ref().filter(|_| observers.enabled) else {
        return Ok(None);
    };
    taut_link::check_secret_file(file).map_err(|reason| {
        Failure::BadInput(format!(
            "cannot use the token of [observers] in {}: {reason}",
            file.display()
        ))
    })?;
    observers.token().map_err(Failure::bad_input)
}

impl Outlets {
    /// Makes `state` the newest for everybody. Wait-free, no allocation.
    pub fn publish(&mut self, state: &HotState) {
        for outlet in &mut self.0 {
            outlet.publish(state);
        }
    }

    /// One more who is published to.
    pub(crate) fn add(&mut self) -> StateFeed {
        let (outlet, feed) = state_channel();
        self.0.push(outlet);
        feed
    }
}

impl ObserverServices {
    /// Opens what is wanted.
    ///
    /// # Errors
    /// A port cannot be had, or a router's configuration is wrong.
    pub fn start(
        settings: &ObserverSettings,
        scene: &SceneDescription,
        #[cfg_attr(
            not(feature = "zenoh"),
            expect(unused_variables, reason = "for times of ROS 2")
        )]
        clock: SessionClock,
    ) -> Result<(Self, Outlets), Failure> {
        let (mut services, mut outlets) = (Self::default(), Outlets::default());
        if settings.vrpn.enabled {
            services.vrpn = Some(vrpn_server(&settings.vrpn, scene, outlets.add())?);
        }
        let hello = |rate| Hello {
            workbench: settings.workbench.clone(),
            program: concat!("taut ", env!("CARGO_PKG_VERSION")).to_owned(),
            scene: scene.clone(),
            rate,
        };
        let stream = &settings.stream;
        if stream.enabled {
            let server = stream_server(settings, &hello(stream.rate), outlets.add())?;
            services.stream = Some(server);
        }
        #[cfg(feature = "zenoh")]
        if settings.zenoh.enabled {
            let zenoh = &settings.zenoh;
            let publisher = taut_zenoh::ZenohPublisher::start(
                taut_zenoh::ZenohSettings {
                    name: zenoh.name.clone(),
                    connect: zenoh.connect.clone(),
                    config: zenoh.config.clone(),
                    rate: zenoh.rate,
                    naming: event_name,
                    ros: zenoh.ros.then_some(taut_zenoh::RosSettings {
                        domain: taut_zenoh::Domain(zenoh.ros_domain),
                        session_time: taut_zenoh::SessionTime::reading(clock.now()),
                    }),
                },
                &hello(zenoh.rate),
                outlets.add(),
            );
            services.zenoh = Some(publisher.map_err(Failure::bad_input)?);
        }
        Ok((services, outlets))
    }

    /// The VRPN server's address, with the port that it got.
    pub fn vrpn(&self) -> Option<SocketAddrV4> {
        self.vrpn.as_ref().map(VrpnServer::address)
    }

    /// The JSON lines' address, with the port that it got.
    pub fn stream(&self) -> Option<SocketAddr> {
        self.stream.as_ref().map(StreamServer::address)
    }

    /// Makes this the newest text at `/metrics`.
    pub fn publish_metrics(&self, text: String) {
        if let Some(stream) = &self.stream {
            stream.publish_metrics(text);
        }
    }

    /// Whether anybody can read metrics here.
    pub fn shows_metrics(&self) -> bool {
        self.stream.is_some()
    }

    /// Those who read the JSON lines.
    pub fn stream_observers(&self) -> u64 {
        self.stream
            .as_ref()
            .map_or(0, |stream| stream.observers() as u64)
    }

    /// Those of them that were given up because they took nothing.
    pub fn stream_observers_dropped(&self) -> u64 {
        self.stream.as_ref().map_or(0, StreamServer::dropped)
    }

    /// One line for each way to look on.
    pub fn lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        if let Some(address) = self.vrpn() {
            lines.push(format!(
                "VRPN (no password): port {} of {}",
                address.port(),
                address.ip()
            ));
        }
        if let Some(address) = self.stream() {
            lines.push(format!(
                "observers: http://{address}/, ws://{address}/ws and http://{address}/metrics"
            ));
        }
        #[cfg(feature = "zenoh")]
        if let Some(zenoh) = &self.zenoh {
            lines.push(format!("Zenoh: {}/**", zenoh.prefix()));
            if let Some(namespace) = zenoh.ros_namespace() {
                lines.push(format!("ROS 2 by rmw_zenoh: {namespace}"));
            }
        }
        lines
    }
}

fn vrpn_server(
    wanted: &Vrpn,
    scene: &SceneDescription,
    feed: StateFeed,
) -> Result<VrpnServer, Failure> {
    let address = SocketAddrV4::new(wanted.bind, wanted.port);
    let settings = VrpnSettings {
        address,
        rate: wanted.rate,
        tracker: wanted.tracker.clone(),
        max_clients: wanted.max_clients,
        frame: VrpnFrame::of(scene)
            .ok_or_else(|| Failure::failed("the scene's origin is no pose"))?,
    };
    VrpnServer::start(settings, feed).map_err(|error| not_opened("vrpn", address, &error))
}

fn stream_server(
    wanted: &ObserverSettings,
    hello: &Hello,
    feed: StateFeed,
) -> Result<StreamServer, Failure> {
    let stream = &wanted.stream;
    let address = SocketAddr::new(stream.bind, stream.port);
    let settings = StreamSettings {
        address,
        rate: stream.rate,
        token: wanted.token.clone(),
        max_observers: stream.max_observers,
        naming: event_name,
    };
    StreamServer::start(settings, hello, feed)
        .map_err(|error| not_opened("observers", address, &error))
}

/// What the device port's events are called.
fn event_name(kind: u8) -> Option<&'static str> {
    EventKind::from_number(kind).map(EventKind::sentence)
}

fn not_opened(table: &str, address: impl std::fmt::Display, error: &std::io::Error) -> Failure {
    Failure::bad_input(format!(
        "[{table}] cannot listen on {address} ({error}); free the address or choose another port"
    ))
}
