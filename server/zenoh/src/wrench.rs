//! A subscription of `geometry_msgs/msg/WrenchStamped`: a force from outside, from a node of ROS 2.
//!
//! What may give a force must be proven: routers elsewhere are dialled by TLS with a certificate of this end, and their own access control says who may put.
//! Others are refused by name, unless the workbench file allows them.

use std::net::IpAddr;
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::time::Duration;

use god_object::spatial::Vector6;
use taut_ros::wire::{ATTACHMENT_BYTES, key};
use taut_ros::{Attachment, Domain, ReceivedWrench, WrenchStamped};
use zenoh::sample::{Sample, SampleKind};
use zenoh::{Config, Wait};

use crate::publisher::ZenohError;
use crate::ros::node;
use crate::routers::{Routers, client_config};

/// Name of the node that subscribes.
const NODE: &str = "taut_wrench_in";
/// Largest number that is taken for one of a wrench, N or N m, as in taut's own datagrams.
const MAX_NUMBER: f64 = 1e6;
/// Time between two looks whether it is to end.
const LOOK_PERIOD: Duration = Duration::from_millis(50);

/// How the subscription is set up.
#[derive(Clone, Debug)]
pub struct RosWrenchSettings {
    /// Name of the workbench, the node's namespace.
    pub name: String,
    /// Routers to dial.
    pub connect: Vec<String>,
    /// Zenoh's own configuration, JSON5.
    pub config: Option<PathBuf>,
    /// The domain.
    pub domain: Domain,
    /// Absolute name of the topic.
    pub topic: String,
    /// The routers may be such as prove nobody.
    pub allow_unproven: bool,
}

/// What came.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RosWrench {
    /// A wrench: force then torque, N and N m, finite and in range.
    Wrench {
        /// As it was sent.
        wrench: Vector6,
        /// Beside it.
        attachment: Attachment,
    },
    /// A message that is no wrench: cut, not finite, out of range.
    NoWrench,
    /// A message without the attachment of ROS 2: nobody knows when it was sent.
    NoAttachment,
}

/// A running subscription. Dropped, it ends.
#[derive(Debug)]
pub struct RosWrenchSubscriber {
    _thread: Routers,
}

impl RosWrenchSubscriber {
    /// Checks the configuration and starts to hand what comes to `taker`, on a thread of Zenoh. A router that is not there yet is waited for.
    ///
    /// # Errors
    /// [`ZenohError`]: also where routers prove nobody and that is not allowed.
    pub fn start(
        settings: RosWrenchSettings,
        mut taker: impl FnMut(RosWrench) + Send + Sync + 'static,
    ) -> Result<Self, ZenohError> {
        let config = client_config(&settings.connect, settings.config.as_deref())?;
        if !settings.allow_unproven {
            check_proven(&config)?;
        }
        let thread = Routers::reach("zenoh-wrench", config, move |session, stop| {
            let node = node(session, settings.domain, &settings.name, NODE);
            let token = node.subscription::<WrenchStamped<'_>>(1, &settings.topic);
            let subscribed = (|| {
                let subscriber = session
                    .declare_subscriber(key::<WrenchStamped<'_>>(settings.domain, &settings.topic))
                    .callback_mut(move |sample| taker(read(&sample)))
                    .wait()?;
                let tokens = [node.token(), token]
                    .map(|token| session.liveliness().declare_token(token).wait());
                zenoh::Result::Ok((subscriber, tokens))
            })();
            if let Err(error) = &subscribed {
                tracing::error!("the topic of [wrench_in] cannot be subscribed to: {error}");
            }
            while !stop.load(Ordering::Relaxed) {
                std::thread::sleep(LOOK_PERIOD);
            }
        })?;
        Ok(Self { _thread: thread })
    }
}

fn read(sample: &Sample) -> RosWrench {
    let payload = sample.payload().to_bytes();
    let wrench = ReceivedWrench::decode(&payload).map(|read| read.wrench);
    // NaN is not within.
    let is_wrench = |wrench: &Vector6| wrench.iter().all(|x| x.abs() <= MAX_NUMBER);
    let Some(wrench) =
        wrench.filter(|wrench| is_wrench(wrench) && sample.kind() == SampleKind::Put)
    else {
        return RosWrench::NoWrench;
    };
    let attachment = sample
        .attachment()
        .filter(|bytes| bytes.len() == ATTACHMENT_BYTES);
    match attachment.and_then(|bytes| Attachment::decode(&bytes.to_bytes())) {
        Some(attachment) => RosWrench::Wrench { wrench, attachment },
        None => RosWrench::NoAttachment,
    }
}

/// Whether all routers that would be dialled prove who they are and are shown who this is, or are on this machine.
fn check_proven(config: &Config) -> Result<(), ZenohError> {
    let endpoints = config.get_json("connect/endpoints").unwrap_or_default();
    let tls = config.get_json("transport/link/tls").unwrap_or_default();
    let has = |key: &str| {
        // `"key":"value"`, where one that is not set is null.
        let (_, rest) = tls.split_once(&format!("\"{key}\":"))?;
        (!rest.trim_start().starts_with("null")).then_some(())
    };
    let has_certificates = has("root_ca_certificate")
        .or_else(|| has("root_ca_certificate_base64"))
        .and_then(|()| has("connect_private_key").or_else(|| has("connect_private_key_base64")));
    let dialled = endpoints.split('"').filter(|text| text.contains('/'));
    for endpoint in dialled {
        let proven = endpoint.starts_with("tls/") && has_certificates.is_some();
        if !proven && !is_loopback(endpoint) {
            return Err(ZenohError::Unproven(endpoint.to_owned()));
        }
    }
    Ok(())
}

/// Whether an endpoint such as `tcp/127.0.0.1:7447` is on this machine.
fn is_loopback(endpoint: &str) -> bool {
    let address = endpoint.split_once('/').map_or("", |(_, address)| address);
    let address = address.split(['?', '#']).next().unwrap_or_default();
    let host = address.rsplit_once(':').map_or(address, |(host, _)| host);
    let host = host.trim_start_matches('[').trim_end_matches(']');
    host == "localhost" || host.parse().is_ok_and(|ip: IpAddr| ip.is_loopback())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn config(endpoints: &str, more: &[(&str, &str)]) -> Config {
        let mut config = Config::default();
        let endpoints = ("connect/endpoints", endpoints);
        for (key, value) in [&[endpoints], more].concat() {
            config.insert_json5(key, value).expect("a key of Zenoh's");
        }
        config
    }

    #[test]
    fn only_routers_here_or_with_certificates_on_both_sides_may_give_forces() {
        for here in [
            "tcp/127.0.0.1:7447",
            "tcp/localhost:7447",
            "tcp/[::1]:7447",
            "udp/127.3.2.1:1",
        ] {
            assert!(
                check_proven(&config(&format!("[{here:?}]"), &[])).is_ok(),
                "{here}"
            );
        }
        let certificates = [
            ("transport/link/tls/root_ca_certificate", "\"ca.pem\""),
            ("transport/link/tls/connect_private_key", "\"key.pem\""),
        ];
        let far = "[\"tls/router.example:7447\"]";
        assert!(check_proven(&config(far, &certificates)).is_ok());
        for (endpoints, more) in [
            ("[\"tcp/192.0.2.7:7447\"]", &certificates[..]),
            ("[\"tcp/127.0.0.1.example:7447\"]", &[]),
            ("[\"tcp/localhost.example:7447\"]", &[]),
            (far, &[]),
            (far, &certificates[..1]),
            ("[\"tcp/127.0.0.1:7447\", \"tcp/192.0.2.7:7447\"]", &[]),
        ] {
            let why = check_proven(&config(endpoints, more))
                .expect_err(endpoints)
                .to_string();
            assert!(why.contains("allow_unproven"), "{why}");
        }
    }
}
