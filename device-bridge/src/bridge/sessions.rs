//! A bridge at work: one session after another, with one device loop that goes from each to the next.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use taut_link::proto::control::LogLevel;
use taut_link::proto::membership::Liveness;
use taut_link::proto::{CouplingOffer, SceneDescription};
use taut_link::{ClientLink, LinkWatch, Rejoiner};

use super::over::Over;
use super::{BridgeError, WATCH_PERIOD};
use crate::arm_switch::ArmSwitch;
use crate::bridge_loop::BridgeLoop;
use crate::cli::{BridgeArgs, CouplingChoice};
use crate::device::DeviceFault;
use crate::device_loop::{DeviceLoop, Notice, Totals};
use crate::edge::EdgeCoupler;
use crate::own_thread::ThreadError;
use crate::port::{CommandSource, SafetySettings};
use crate::report::BridgeReport;

/// Notices that may wait to be told; more are dropped, the counts in the report are complete.
const NOTICES: usize = 64;

/// The thread of the device loop. It ends with this, also where this thread breaks down: no loop goes on that nobody watches, and a process that
/// returns from `main` takes no loop with it that holds a force.
struct LoopThread<T> {
    end: Arc<AtomicBool>,
    thread: Option<JoinHandle<T>>,
}

impl<T> LoopThread<T> {
    fn is_finished(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// Asks the loop to end, and waits until the force is gone; nothing where the loop broke down.
    fn end(&mut self) -> Option<T> {
        self.end.store(true, Ordering::Relaxed);
        self.thread.take()?.join().ok()
    }
}

impl<T> Drop for LoopThread<T> {
    fn drop(&mut self) {
        let _ = self.end(); // there is nobody to give it to
    }
}

enum SessionEnd {
    Duration,
    Signal,
    TraceEnded,
    /// The server told its clients that it stops.
    ServerStopped,
    /// The server told them that it begins another session.
    ServerChanges,
    /// It is gone for another reason.
    ServerLost(String),
}

pub(super) struct Run<'a> {
    pub(super) args: &'a BridgeArgs,
    /// The device was placed in it.
    pub(super) scene: SceneDescription,
    /// Incarnation of the server that commanded last.
    pub(super) epoch: Option<u32>,
    pub(super) rejoiner: Rejoiner,
    pub(super) runtime: tokio::runtime::Runtime,
    pub(super) over: Over,
    pub(super) safety: SafetySettings,
    pub(super) wishes: Arc<ArmSwitch>,
    pub(super) totals: Totals,
    /// Opens the device where a scene wants it; `None` where it cannot be opened twice.
    pub(super) build: &'a mut Build<'a>,
}

/// See [`Run`].
pub(super) type Build<'a> =
    dyn FnMut(&SceneDescription) -> Result<Option<BridgeLoop>, BridgeError> + 'a;

impl Run<'_> {
    pub(super) fn sessions(
        &mut self,
        first: ClientLink,
        mut bridge: BridgeLoop,
    ) -> Result<BridgeReport, BridgeError> {
        let mut link = first;
        loop {
            self.totals.sessions += 1;
            let end;
            (bridge, end) = self.session(link, bridge)?;
            let reason = match end {
                SessionEnd::Duration => return Ok(self.report(&bridge, "done")),
                SessionEnd::Signal => return Ok(self.report(&bridge, "stopped by a signal")),
                SessionEnd::TraceEnded => return Ok(self.report(&bridge, "the trace ended")),
                SessionEnd::ServerStopped if self.args.stay => {
                    tracing::info!("the server stopped: the force is zero; waiting for it");
                    "it stopped".to_owned()
                }
                SessionEnd::ServerStopped => {
                    tracing::info!("the server stopped: the force is zero");
                    return Ok(self.report(&bridge, "the server stopped"));
                }
                SessionEnd::ServerChanges => {
                    tracing::info!(
                        "the server begins another session: the force is zero till then"
                    );
                    "it begins another session".to_owned()
                }
                SessionEnd::ServerLost(reason) => {
                    tracing::warn!(
                        "the server was lost ({reason}): the force is zero; trying again"
                    );
                    reason
                }
            };
            let Some(joined) = self.join_again(&reason, &bridge)? else {
                return Ok(self.report(&bridge, "done while the server was away"));
            };
            link = joined;
            if same_place(&self.scene, link.description()) {
                let after = if self.epoch == Some(link.epoch()) {
                    "any silence"
                } else {
                    "a restart"
                };
                tracing::info!("joined again: the force comes back as after {after}");
            } else {
                bridge = match self.placed(bridge, link.description()) {
                    Ok(placed) => placed,
                    Err(error) => {
                        // Its name is free again at once.
                        self.runtime.block_on(link.leave());
                        return Err(error);
                    }
                };
            }
        }
    }

    /// The device opened anew in another scene: where it stands there is known when it is opened. Some are calibrated then, strings with the
    /// grip at the centre and arms on HID boards at their home, so a person has to hold them there.
    fn placed(
        &mut self,
        bridge: BridgeLoop,
        scene: &SceneDescription,
    ) -> Result<BridgeLoop, BridgeError> {
        let other_scene = || BridgeError::other_scene(self.args, scene);
        if self.args.device.is_calibrated_when_opened() {
            return Err(other_scene());
        }
        let past = bridge.close();
        let mut placed = (self.build)(scene)?.ok_or_else(other_scene)?;
        placed.go_on_from(past);
        // Its port knows nothing of what was wished at the one before.
        self.wishes.begin_again();
        self.scene = scene.clone();
        self.safety = *placed.port().settings();
        tracing::info!(
            "joined another scene ({}): the device finds its place in it anew, and the force comes back as after a restart",
            scene.name
        );
        Ok(placed)
    }

    /// Joins again; `None` if the end comes first.
    fn join_again(
        &mut self,
        reason: &str,
        bridge: &BridgeLoop,
    ) -> Result<Option<ClientLink>, BridgeError> {
        let joined = self.runtime.block_on(self.over.or(self.rejoiner.rejoin()));
        match joined {
            None => Ok(None),
            Some(None) => {
                let report = self.report(bridge, &format!("the server was lost: {reason}"));
                Err(BridgeError::ServerLost {
                    server: self.args.server.clone(),
                    reason: reason.to_owned(),
                    report: Box::new(report),
                })
            }
            Some(Some(link)) => Ok(Some(link)),
        }
    }

    /// Runs the device loop on `link` until something ends it; gives the loop back.
    fn session(
        &mut self,
        link: ClientLink,
        mut bridge: BridgeLoop,
    ) -> Result<(BridgeLoop, SessionEnd), BridgeError> {
        let link = Arc::new(link);
        let (sender, notices) = sync_channel(NOTICES);
        let period = Duration::from_secs_f64(1.0 / self.args.rate);
        let source = match self.epoch.replace(link.epoch()) {
            Some(epoch) if epoch == link.epoch() => CommandSource::Same,
            _ => CommandSource::Other,
        };
        let edge = edge_coupler(self.args.coupling, link.coupling())?
            .map(|coupler| coupler.within(period));
        taut_log::say(&format!(
            "joined {}, scene {}: the force is computed {}",
            self.args.server,
            link.description().name,
            if edge.is_some() {
                "here"
            } else {
                "at the server"
            }
        ));
        bridge.begin_session(source, edge);
        let mut thread = self.start_device_loop(&link, bridge, period, sender)?;

        let dead_after = self.rejoiner.policy().dead_after;
        let mut watch = LinkWatch::new(Instant::now(), dead_after.unwrap_or(link.node_timeout()));
        let mut end = None;
        while end.is_none() && !thread.is_finished() {
            thread::sleep(WATCH_PERIOD);
            self.over.alive.watch.count();
            end = self.session_end(&link, &mut watch, &notices);
        }
        if matches!(
            end,
            Some(SessionEnd::ServerStopped | SessionEnd::ServerChanges | SessionEnd::ServerLost(_))
        ) {
            // Let the force fade as on any silence, rather than cut it.
            let settings = self.safety;
            thread::sleep(settings.hold + settings.ramp_out);
        }
        let (bridge, totals) = thread.end().ok_or(BridgeError::LoopBroke)?;
        self.totals = totals;
        tell(&link, &notices);

        let seen = link.counters();
        self.totals.packets.packets_sent += seen.packets_sent;
        self.totals.packets.packets_received += seen.packets_received;
        self.totals.packets.lost += seen.lost;
        if link.is_closed().is_none() {
            self.runtime.block_on(link.leave());
        }
        let end = end.unwrap_or(match bridge.fault() {
            Some(DeviceFault::Ended) => SessionEnd::TraceEnded,
            _ => SessionEnd::Signal,
        });
        Ok((bridge, end))
    }

    /// Starts the thread that ticks `bridge`. It has the totals until it ends.
    fn start_device_loop(
        &mut self,
        link: &Arc<ClientLink>,
        mut bridge: BridgeLoop,
        period: Duration,
        notices: SyncSender<Notice>,
    ) -> Result<LoopThread<(BridgeLoop, Totals)>, BridgeError> {
        let end_loop = Arc::new(AtomicBool::new(false));
        let mut device_loop = DeviceLoop {
            link: Arc::clone(link),
            end: Arc::clone(&end_loop),
            asked: self.over.end.clone(),
            wishes: Arc::clone(&self.wishes),
            turns: self.over.alive.device.clone(),
            notices,
            period,
            priority: self.args.priority,
            core: self.args.core,
            totals: std::mem::take(&mut self.totals),
        };
        let thread = thread::Builder::new()
            .name("taut-bridge-dev".to_owned())
            .spawn(move || {
                device_loop.run(&mut bridge);
                (bridge, device_loop.totals)
            })
            .map_err(|cause| ThreadError("the device loop", cause.to_string()))?;
        Ok(LoopThread {
            end: end_loop,
            thread: Some(thread),
        })
    }

    fn session_end(
        &self,
        link: &ClientLink,
        watch: &mut LinkWatch,
        notices: &Receiver<Notice>,
    ) -> Option<SessionEnd> {
        tell(link, notices);
        let silent = watch.look(link, Instant::now()) == Liveness::Dead;
        if self.over.is_asked() {
            return Some(SessionEnd::Signal);
        }
        if self.over.is_now() {
            return Some(SessionEnd::Duration);
        }
        match link.ended() {
            Some(taut_link::SessionEnd::ServerStopped) => Some(SessionEnd::ServerStopped),
            Some(change) if change.is_change() => Some(SessionEnd::ServerChanges),
            Some(taut_link::SessionEnd::Lost(reason)) => Some(SessionEnd::ServerLost(reason)),
            None if silent => {
                link.abandon();
                Some(SessionEnd::ServerLost("it fell silent".to_owned()))
            }
            None => None,
        }
    }

    fn report(&self, bridge: &BridgeLoop, ended: &str) -> BridgeReport {
        let (totals, stats) = (&self.totals, bridge.stats());
        let start = totals.first_tick.unwrap_or(totals.last_tick);
        BridgeReport {
            device: bridge.port().info().name.clone(),
            sensed_degrees_of_freedom: bridge.port().info().sensed_degrees_of_freedom,
            actuated_degrees_of_freedom: bridge.port().info().actuated_degrees_of_freedom,
            server: self.args.server.clone(),
            ended: ended.to_owned(),
            duration_s: totals.last_tick.saturating_sub(start).as_secs_f64(),
            ticks: stats.ticks,
            missed_periods: totals.missed,
            period_us: totals.period.summary(),
            coupling: if bridge.couples() { "edge" } else { "server" }.to_owned(),
            sets: stats.sets,
            broken_sets: stats.broken_sets,
            set_age_us: stats.set_age.summary(),
            wrenches: stats.wrenches,
            wrench_age_us: stats.wrench_age.summary(),
            round_trip_us: stats.round_trip.summary(),
            packets_sent: totals.packets.packets_sent,
            packets_received: totals.packets.packets_received,
            packets_lost: totals.packets.lost,
            energy_injected_j: bridge.energy()[0],
            energy_delivered_j: bridge.energy()[1],
            external_wrenches: bridge.external().map_or(0, |seen| seen.taken()),
            max_external_age_ms: bridge
                .external()
                .map_or(0.0, |seen| seen.largest_age().as_secs_f64() * 1e3),
            max_force_age_ms: stats.max_force_age.as_secs_f64() * 1e3,
            max_force_n: stats.max_force,
            max_torque_n_m: stats.max_torque,
            safety_events: stats.safety_events,
            faulty_ticks: stats.faulty_ticks,
            sessions: totals.sessions,
            realtime: totals.realtime.iter().map(ToString::to_string).collect(),
        }
    }
}

/// Whether the device stands in both scenes alike.
fn same_place(before: &SceneDescription, now: &SceneDescription) -> bool {
    before.reference_point == now.reference_point
        && before.scene_origin == now.scene_origin
        && before.display_scale == now.display_scale
        && before.god_object.pose == now.god_object.pose
}

/// Logs what the device loop noticed, here and at the server.
fn tell(link: &ClientLink, notices: &Receiver<Notice>) {
    for notice in notices.try_iter() {
        let (warning, text) = match notice {
            Notice::Safety(event) => (event.kind.is_warning(), event.to_string()),
            Notice::Refused(broken) => (true, broken.to_string()),
            Notice::Unkept => (
                true,
                "a force from outside is not felt here: start this bridge with --passivity control"
                    .to_owned(),
            ),
        };
        let level = if warning {
            tracing::warn!("{text}");
            LogLevel::Warning
        } else {
            tracing::info!("{text}");
            LogLevel::Info
        };
        link.post_log(level, text);
    }
}

/// The coupling of a session, if it is to be here.
fn edge_coupler(
    choice: Option<CouplingChoice>,
    offer: Option<&CouplingOffer>,
) -> Result<Option<EdgeCoupler>, BridgeError> {
    match (choice, offer) {
        (Some(CouplingChoice::Server), _) | (None, None) => Ok(None),
        (_, Some(CouplingOffer::AtEdge(offer))) => Ok(Some(EdgeCoupler::new(offer)?)),
        (None, Some(CouplingOffer::AtServer { reason })) => {
            tracing::warn!("the force is not computed here: {reason}");
            Ok(None)
        }
        (Some(CouplingChoice::Edge), Some(CouplingOffer::AtServer { reason })) => {
            Err(BridgeError::NoEdge(reason.to_string()))
        }
        (Some(CouplingChoice::Edge), None) => {
            let reason = "it says nothing of another way";
            Err(BridgeError::NoEdge(reason.to_owned()))
        }
    }
}

#[cfg(test)]
mod tests {
    use taut_link::proto::scene::BodyDescription;
    use taut_link::proto::{MeshHash, PoseF64};
    use taut_link::{RejoinPolicy, create_key_file};

    use super::super::over::Alive;
    use super::super::setup::{Motion, build_loop, client_options};
    use super::*;
    use crate::arm_switch::ArmWish;
    use crate::port::Rearm;
    use crate::signals::EndFlag;

    /// A body that starts at this height, m.
    fn scene(height: f64) -> SceneDescription {
        let body = BodyDescription {
            name: "tip".into(),
            mesh: MeshHash::of(&[]),
            pose: PoseF64 {
                position: [0.0, 0.0, height],
                ..PoseF64::IDENTITY
            },
            colour: [1.0; 4],
        };
        SceneDescription::of_body("wall", body)
    }

    #[test]
    fn who_wanted_no_force_is_asked_in_another_place_too() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let key = folder.path().join("key");
        create_key_file(&key).expect("a key");
        let mut args = BridgeArgs::joining("127.0.0.1:1", "bridge").expect("valid");
        args.key = Some(key);
        let motion = Motion::Held {
            path: None,
            strings: None,
        };
        let mut build = |scene: &SceneDescription| build_loop(&args, &motion, scene).map(Some);
        let mut bridge = build_loop(&args, &motion, &scene(0.0)).expect("simulated");
        assert_eq!(bridge.port().settings().rearm, Rearm::Automatic);
        let options = client_options(&args).expect("a key");
        let mut run = Run {
            args: &args,
            scene: scene(0.0),
            epoch: None,
            rejoiner: Rejoiner::new(options, RejoinPolicy::default()),
            runtime: tokio::runtime::Builder::new_current_thread()
                .build()
                .expect("a runtime"),
            over: Over {
                end: EndFlag::default(),
                deadline: None,
                alive: Alive::default(),
            },
            safety: *bridge.port().settings(),
            wishes: Arc::default(),
            totals: Totals::default(),
            build: &mut build,
        };
        run.wishes.wish(ArmWish::Disarm);
        assert_eq!(run.wishes.take(), Some(ArmWish::Disarm), "the loop's");
        for height in [0.1, 0.2] {
            bridge = run.placed(bridge, &scene(height)).expect("simulated");
            assert_eq!(run.wishes.take(), Some(ArmWish::Disarm), "at {height} m");
        }
        run.wishes.wish(ArmWish::Arm);
        let _ = run.placed(bridge, &scene(0.3)).expect("simulated");
        assert_eq!(run.wishes.take(), None, "of the place before");
    }

    #[test]
    fn a_watcher_that_breaks_down_takes_the_device_loop_with_it() {
        let (end, ended) = (Arc::<AtomicBool>::default(), Arc::<AtomicBool>::default());
        let (of_loop, end_noted) = (Arc::clone(&end), Arc::clone(&ended));
        let broke = std::panic::catch_unwind(move || {
            let thread = thread::Builder::new().spawn(move || {
                while !of_loop.load(Ordering::Relaxed) {
                    thread::sleep(Duration::from_millis(1));
                }
                end_noted.store(true, Ordering::Relaxed);
            });
            let _thread = LoopThread {
                end,
                thread: thread.ok(),
            };
            panic!("on purpose");
        });
        assert!(broke.is_err());
        assert!(ended.load(Ordering::Relaxed), "the loop goes on");
    }
}
