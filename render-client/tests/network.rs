//! A node in a session with a real server on this machine: joins, fetches, draws, reports, ends.
//! Left out, said aloud, without a graphics adapter.

use crate::live::{Server, barrier, can_draw, content, start, wait_for};

use std::sync::atomic::Ordering;

use image::RgbaImage;
use taut_link::Content;
use taut_proto::barrier::{MasterSettings, Swap};
use taut_proto::{Finish, Look, Looks, MeshHash, Panorama, Texture, TextureUse, Textures, Wrap};
use taut_render::RenderError;
use taut_render::cli::{RenderArgs, TransportArg};
use taut_render::statistics::Ended;

/// What the table shows of this content in the first frame.
fn drawn(content: Content) -> RgbaImage {
    let server = Server::serving(None, content);
    let mut args = server.args("both");
    (args.frames, args.out) = (Some(1), Some(server.pictures()));
    taut_render::run(args).expect("draws");
    let picture = server.picture("both-table-00001.png");
    server.stop();
    picture
}

fn count(picture: &RgbaImage, kind: impl Fn([u8; 4]) -> bool) -> usize {
    picture.pixels().filter(|pixel| kind(pixel.0)).count()
}

fn is_orange([red, _, blue, _]: [u8; 4]) -> bool {
    red > 90 && red / 2 > blue
}

#[test]
fn a_node_draws_what_it_is_told_over_either_transport_and_reports_it() {
    if !can_draw() {
        return;
    }
    for transport in [TransportArg::Udp, TransportArg::Quic] {
        let server = Server::start();
        let mut args = server.args("both");
        args.transport = transport;
        args.frames = Some(5);
        args.out = Some(server.pictures());
        let report = taut_render::run(args).expect("draws");
        assert_eq!((report.frames, report.ended), (5, Ended::Frames));
        assert_eq!(report.pose_age_ms.count, 5);
        assert!(report.drawn_age_ms.p50 >= report.pose_age_ms.p50);
        assert!(
            report.pose_age_ms.p50 >= 2.0,
            "the delay is part of the age"
        );
        assert!(report.packets_received > 0);
        let (timing, light) = (&report.present_timing, report.light_ms);
        assert!(timing.contains("no window lights up"), "{timing}");
        assert_eq!((light.count, report.unlit), (0, 0));

        for screen in ["wall", "table"] {
            for frame in 1..=5 {
                let picture = server.picture(&format!("both-{screen}-{frame:05}.png"));
                assert_eq!(picture.dimensions(), (120, 80));
            }
        }
        // The peg points at the viewer: orange on the table's screen.
        let orange = count(&server.picture("both-table-00005.png"), is_orange);
        assert!(orange > 30, "{orange} orange pixels");
        server.stop();
    }
}

#[test]
fn a_node_draws_in_the_light_that_the_server_names() {
    if !can_draw() {
        return;
    }
    let redness = |light: Option<Panorama>| {
        let mut content = content();
        let hash = |light: &Panorama| MeshHash::of(&light.encode());
        content.description.environment = light.as_ref().map(hash);
        content.panorama = light;
        let picture = drawn(content);
        let sum = |part: usize| -> f64 { picture.pixels().map(|p| f64::from(p.0[part])).sum() };
        sum(0) / sum(2)
    };
    let (studio, red) = (
        redness(None),
        redness(Some(Panorama::from_fn(|_, _| [1.0, 0.1, 0.02]))),
    );
    assert!(red > 1.3 * studio, "{red} {studio}");
}

#[test]
fn a_node_draws_the_textures_that_the_server_sends() {
    if !can_draw() {
        return;
    }
    let green = Texture::new((1, 1), vec![[0, 255, 0, 255]]).expect("a texture");
    let mut content = content();
    let mesh = &content.meshes[0];
    let triangles = mesh.triangles().len();
    let looks = Looks {
        list: vec![Look {
            colour: [1.0; 3],
            finish: Finish {
                roughness: 1.0,
                metallic: 0.0,
            },
        }],
        of_triangles: vec![0; triangles],
    };
    let textures = Textures {
        list: vec![TextureUse {
            texture: MeshHash::of(&green.encode()),
            wrap: [Wrap::Repeat; 2],
        }],
        of_looks: vec![Some(0)],
        coordinates: vec![[[0.0; 2], [1.0, 0.0], [0.0, 1.0]]; triangles],
    };
    let mesh = mesh.clone().with_looks(looks).expect("of the mesh");
    let mesh = mesh.with_textures(textures).expect("of the mesh");
    content.description.god_object.mesh = MeshHash::of(&mesh.encode().expect("small"));
    content.meshes[0] = mesh;
    content.textures = vec![std::sync::Arc::new(green)];
    let picture = drawn(content);
    let green = count(&picture, |p| p[1] > 60 && p[1] / 2 > p[0].max(p[2]));
    let orange = count(&picture, is_orange);
    assert!(green > 30 && orange == 0, "{green} green, {orange} orange");
}

#[test]
fn a_node_with_two_pictures_per_screen_names_them_by_eye() {
    if !can_draw() {
        return;
    }
    let server = Server::start();
    let mut args = server.args("pair");
    (args.frames, args.out) = (Some(1), Some(server.pictures()));
    taut_render::run(args).expect("draws");
    for eye in ["left", "right"] {
        server.picture(&format!("pair-wall-{eye}-00001.png"));
    }
    server.stop();
}

#[test]
fn a_node_ends_in_good_order_when_the_server_says_that_it_stops() {
    if !can_draw() {
        return;
    }
    let server = Server::start();
    let node = start(server.args("both"));
    wait_for("a report of frames", || server.frames("both") > 0);
    let clients = server.link.clients();
    assert!(clients.iter().all(|c| c.state_hash_mismatches == 0));
    let some = clients.iter().any(|c| c.state_hash_matches > 0);
    assert!(some, "the states drawn are those that were sent");
    server.stop();
    let report = node.join().expect("no panic").expect("a good end");
    assert_eq!(report.ended, Ended::ServerStopped);
}

/// One node with two screens, one with two pictures of a screen: each is one member, and all frames show what was released for them.
#[test]
fn nodes_show_the_frames_that_the_barrier_releases() {
    if !can_draw() {
        return;
    }
    for swap in [Swap::Immediate, Swap::Scheduled] {
        let server = Server::start_with(Some(barrier(swap)));
        let nodes = ["both", "pair"].map(|node| {
            start(RenderArgs {
                fps: Some(8.0), // what software can do beside other tests: everybody's rate, because the slowest's is
                ..server.args(node)
            })
        });
        let frames = || server.link.frame_report().unwrap_or_default();
        wait_for("frames that both nodes showed in time", || {
            frames().skew.count >= 3
        });
        let measured = frames();
        assert_eq!(measured.counts.mismatches, 0, "{measured:?}");
        assert!(measured.counts.compared >= 6, "{measured:?}");
        assert_eq!(measured.nodes.len(), 2, "{measured:?}");
        server.stop();
        for node in nodes {
            let report = node.join().expect("no panic").expect("a good end");
            assert_eq!(report.ended, Ended::ServerStopped);
            assert!(report.locked_frames >= 3, "{report:?}");
            assert!(report.locked_frames <= report.frames);
        }
    }
}

/// One that is made for fewer frames than the least rate runs free, and draws no more than it was told to.
#[test]
fn a_node_below_the_least_rate_keeps_to_its_own() {
    if !can_draw() {
        return;
    }
    let server = Server::start_with(Some(MasterSettings {
        slowest_ns: 50_000_000,
        ..barrier(Swap::Immediate)
    }));
    let report = taut_render::run(RenderArgs {
        fps: Some(2.0),
        duration: Some(4.0),
        ..server.args("both")
    });
    let report = report.expect("draws");
    // Two a second, one in hand, and the first.
    assert!((1..=10).contains(&report.frames), "{report:?}");
    let measured = server.link.frame_report().unwrap_or_default();
    assert_eq!(measured.counts.mismatches, 0, "{measured:?}");
}

/// Two screens at the same place: whatever moves between two frames, a node's pictures of one frame are the same to the last pixel.
#[test]
fn a_node_with_two_screens_shows_one_instant_on_both_with_a_barrier_and_without() {
    if !can_draw() {
        return;
    }
    for frames in [Some(barrier(Swap::Immediate)), None] {
        let is_locked = frames.is_some();
        let server = Server::start_with(frames);
        let mut args = server.args("twice");
        args.fps = Some(8.0);
        args.frames = Some(12);
        args.out = Some(server.pictures());
        let report = taut_render::run(args).expect("draws");
        assert_eq!(report.locked_frames > 0, is_locked, "{report:?}");
        let mut distinct = std::collections::HashSet::new();
        for frame in 1..=12 {
            let [table, again] = ["table", "again"].map(|screen| {
                let file = format!("twice-{screen}-{frame:05}.png");
                server.picture(&file).into_raw()
            });
            assert!(table == again, "frame {frame}");
            distinct.insert(table);
        }
        assert!(distinct.len() > 3, "the body moves: {}", distinct.len());
        server.stop();
    }
}

#[test]
fn a_server_that_stays_lost_is_an_error_that_names_it() {
    if !can_draw() {
        return;
    }
    let server = Server::start();
    let address = server.address.clone();
    let mut args = server.args("both");
    args.membership.give_up = Some(1.0);
    let node = start(args);
    // It is in by its own reckoning, too: before, nothing would be lost.
    wait_for("a report", || {
        server.link.clients().iter().any(|of| of.stats.is_some())
    });
    // All its threads stop at once, as if its machine had lost power.
    let Server {
        runtime,
        link,
        stop,
        ..
    } = server;
    stop.store(true, Ordering::Relaxed);
    runtime.shutdown_background();
    std::mem::forget(link);
    let error = node.join().expect("no panic").expect_err("lost");
    assert!(matches!(error, RenderError::ServerLost { .. }), "{error}");
    assert!(error.to_string().contains(&address));
    assert_eq!(error.exit_code(), 1);
}

#[test]
fn an_unknown_node_or_screen_is_bad_input_that_names_the_known_ones() {
    if !can_draw() {
        return;
    }
    let server = Server::start();
    let error = taut_render::run(server.args("celing")).expect_err("unknown");
    assert!(error.to_string().contains("both, pair, lost"), "{error}");
    assert_eq!(error.exit_code(), 2);
    let error = taut_render::run(server.args("lost")).expect_err("no such screen");
    assert!(error.to_string().contains("ceiling"), "{error}");
    assert_eq!(error.exit_code(), 2);
    server.stop();
}
