//! The hand that the mouse is: a device bridge of its own, in a thread of this process.
//!
//! The window names targets; the bridge's device loop leads the body there at 1 kHz and sends its poses to the
//! server, as any other device does ([`taut_bridge::run_device`]). The window never waits for it.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use nalgebra::Isometry3;
use taut_bridge::{
    BridgeArgs, BridgeError, Device, LedDevice, OwnThread, Placement, Target, run_device,
};

use crate::cli::RenderArgs;
use crate::error::RenderError;
use crate::hold::Hold;
use crate::stage::Stage;

/// To the device of the scene that is served: another scene's has an end of its own.
type Targets = Arc<Mutex<triple_buffer::Input<Target>>>;

/// The window's end. Dropping it leaves the server.
pub(crate) struct Hand {
    pub(crate) hold: Hold,
    targets: Targets,
    _thread: OwnThread,
}

impl Hand {
    /// Joins the server of `args` once more, as its device, which is led to where `hold` holds the body.
    pub(crate) fn join(args: &RenderArgs, hold: Hold) -> Result<Self, RenderError> {
        let system = |reason: String| RenderError::System {
            what: "hand of the mouse",
            reason,
        };
        let node = format!("{}-mouse", args.node);
        let mut bridge = BridgeArgs::joining(&args.server, &node)
            .ok_or_else(|| system(format!("{} is no address", args.server)))?;
        bridge.key = Some(args.key.clone());
        bridge.transport = args.transport.into();
        bridge.priority = 0; // the picture shares this process
        bridge.stay = args.membership.stay;
        bridge.give_up = args.membership.give_up;
        let (input, _) = triple_buffer::TripleBuffer::new(&target(hold.target(), 0)).split();
        let targets = Targets::new(Mutex::new(input));
        let there = Arc::clone(&targets);
        let thread = OwnThread::start("taut-hand", move |asked| {
            be_the_device(&bridge, asked, &there);
        })
        .map_err(|error| system(error.to_string()))?;
        Ok(Self {
            hold,
            targets,
            _thread: thread,
        })
    }

    /// Leads the body to where it is held now.
    pub(crate) fn lead(&mut self, buttons: u16) {
        let mut targets = self.targets.lock().unwrap_or_else(PoisonError::into_inner);
        targets.write(target(self.hold.target(), buttons));
    }

    /// Holds the body of another scene.
    pub(crate) fn follow(&mut self, stage: &Stage, buttons: u16) {
        self.hold.follow(Hold::new(stage));
        self.lead(buttons);
    }
}

/// Runs the device in one scene after another until `asked` to end, or until the server ends it.
fn be_the_device(bridge: &BridgeArgs, asked: &Arc<AtomicBool>, targets: &Targets) {
    while !asked.load(Ordering::Relaxed) {
        let make = |placement| -> Box<dyn Device> { Box::new(led(targets, placement)) };
        match run_device(bridge, Arc::clone(asked), make) {
            // Where the body stands there is known when the device is made.
            Err(BridgeError::OtherScene { .. }) => {}
            Ok(report) => {
                tracing::debug!("{report}");
                return;
            }
            Err(error) => {
                tracing::error!("the mouse holds nothing: {error}");
                return;
            }
        }
    }
}

/// A body at rest at the start of its scene, which goes where `targets` lead from now on.
fn led(targets: &Targets, placement: Placement) -> LedDevice {
    let first = target(&placement.start, 0);
    let (input, output) = triple_buffer::TripleBuffer::new(&first).split();
    *targets.lock().unwrap_or_else(PoisonError::into_inner) = input;
    LedDevice::new("mouse", output, placement)
}

fn target(pose: &Isometry3<f64>, buttons: u16) -> Target {
    Target {
        pose: *pose,
        buttons,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::thread;
    use std::time::{Duration, Instant};

    use clap::Parser;
    use nalgebra::{Point3, Similarity3};
    use taut_link::{Content, ServerLink, ServerOptions, create_key_file, read_key_file, serve};
    use taut_proto::mesh_blob::Positions;
    use taut_proto::scene::BodyDescription;
    use taut_proto::{MeshBlob, MeshHash, PoseF64, SceneDescription};

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        args: RenderArgs,
    }

    fn start(z: f64) -> PoseF64 {
        PoseF64 {
            position: [0.0, 0.0, z],
            ..PoseF64::IDENTITY
        }
    }

    /// A scene in which the body starts at this height, m.
    fn scene(z: f64) -> Content {
        let corners = vec![
            [0.0; 3],
            [0.01, 0.0, 0.0],
            [0.0, 0.01, 0.0],
            [0.0, 0.0, 0.01],
        ];
        let faces = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let mesh = MeshBlob::new(Positions::F64(corners), faces, None).expect("a tetrahedron");
        let body = BodyDescription {
            name: "tip".into(),
            mesh: MeshHash::of(&mesh.encode().expect("small")),
            pose: start(z),
            colour: [1.0; 4],
        };
        Content {
            description: SceneDescription::of_body("alone", body),
            meshes: vec![mesh],
            textures: Vec::new(),
            panorama: None,
        }
    }

    /// Waits until the device is at this height, m.
    fn wait_for_height(link: &ServerLink, z: f64) {
        let mut inputs = link.device_inputs().expect("nobody else reads");
        let begun = Instant::now();
        loop {
            let input = inputs.read().as_ref();
            let found = input.map(|input| input.sample.pose.position[2]);
            if found.is_some_and(|found| (found - z).abs() < 1e-6) {
                return;
            }
            let patience = Duration::from_secs(60);
            assert!(begun.elapsed() < patience, "{found:?} instead of {z}");
            thread::sleep(Duration::from_millis(5));
        }
    }

    #[test]
    fn the_mouse_holds_the_body_of_another_scene_at_its_start() {
        let folder = tempfile::tempdir().expect("a folder");
        let key_file = folder.path().join("key");
        let key = create_key_file(&key_file).expect("a key");
        let runtime = tokio::runtime::Runtime::new().expect("a runtime");
        let options = ServerOptions::loopback(key);
        let link = runtime.block_on(serve(options, scene(0.05)));
        let link = link.expect("serves");
        let address = link.quic_addr();
        let (server, key) = (address.to_string(), key_file.display().to_string());
        let line = [
            "taut-render",
            "--node",
            "front",
            "--server",
            &server,
            "--key",
            &key,
        ];
        let args = Line::try_parse_from(line).expect("a command line").args;
        let there = start(0.05).to_isometry().expect("a pose");
        let hold = Hold::at(there, Point3::origin(), Similarity3::identity());
        let hand = Hand::join(&args, hold).expect("a thread");
        wait_for_height(&link, 0.05);

        runtime.block_on(link.make_way());
        let options = ServerOptions {
            quic: address,
            ..ServerOptions::loopback(read_key_file(&key_file).expect("the key"))
        };
        let link = runtime.block_on(serve(options, scene(0.08)));
        let link = link.expect("the port is free again");
        wait_for_height(&link, 0.08);
        drop(hand);
        runtime.block_on(link.shutdown());
    }
}
