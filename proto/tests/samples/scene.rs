//! What a render node is told of the scene.

use proptest::prelude::*;
use taut_proto::{
    MeshHash, PoseF64, SceneDescription, Untrusted,
    scene::{
        BodyDescription, NodeDescription, OutputDescription, ScreenDescription, Show, Stereo,
        WindowDescription,
    },
};

use super::values::{finite64, pose64};

pub fn scene() -> SceneDescription {
    let body = |name: &str, byte: u8| BodyDescription {
        name: name.into(),
        mesh: MeshHash { bytes: [byte; 32] },
        pose: PoseF64::IDENTITY,
        colour: [1.0, 0.5, 0.25, 1.0],
    };
    SceneDescription {
        name: "peg".into(),
        revision: 7,
        god_object: body("peg", 1),
        obstacles: vec![body("box", 2)],
        reference_point: [0.0, 0.0, 0.5],
        scene_origin: PoseF64::IDENTITY,
        display_scale: 2.0,
        screens: vec![ScreenDescription {
            name: "front".into(),
            lower_left: [-1.0, 1.0, 0.0],
            lower_right: [1.0, 1.0, 0.0],
            upper_left: [-1.0, 1.0, 1.0],
            output: OutputDescription {
                warp: vec!["left.data".into(), "right.data".into()],
                surface: vec!["wall.pfm".into()],
                blend: vec!["blend.png".into()],
                blend_gamma: 2.0,
                colour: [1.0, 0.25, 0.0, 0.0, 0.5, 0.0, -0.125, 0.0, 1.0],
                gamma: [2.25, 2.0, 0.0],
                sampling: 1.5,
            },
        }],
        nodes: vec![NodeDescription {
            name: "left".into(),
            screens: vec!["front".into()],
            stereo: Stereo::SideBySide,
            window: WindowDescription {
                width: 640,
                height: 480,
                fullscreen: true,
            },
            monitors: vec!["DP-1".into(), "1".into()],
        }],
        viewer: PoseF64::IDENTITY,
        eye_separation: 0.0625,
        near: 0.125,
        far: 8.0,
        separation_scale: 0.75,
        nearest_disparity: 0.0625,
        show: Show {
            ghost: true,
            contacts: false,
            force: true,
            hud: true,
            reflections: false,
        },
        environment: Some(MeshHash { bytes: [3; 32] }),
    }
}

fn text(pattern: &'static str) -> impl Strategy<Value = Untrusted> {
    pattern.prop_map(Untrusted::from)
}

/// Fewer than so many texts.
fn texts(most: usize) -> impl Strategy<Value = Vec<Untrusted>> {
    prop::collection::vec(text(".{0,9}"), 0..most)
}

fn vector() -> impl Strategy<Value = [f64; 3]> {
    prop::array::uniform3(finite64())
}

fn hash() -> impl Strategy<Value = MeshHash> {
    varied!(MeshHash {
        bytes: any::<[u8; 32]>(),
    })
}

fn any_output() -> impl Strategy<Value = OutputDescription> {
    let colour = prop::collection::vec(-16.0..=16.0_f64, 9);
    varied!(OutputDescription {
        warp: texts(3),
        surface: texts(3),
        blend: texts(3),
        blend_gamma: 0.1..=8.0_f64,
        colour: colour.prop_map(|nine| std::array::from_fn(|i| nine[i])),
        gamma: prop::array::uniform3(0.0..=8.0_f64),
        sampling: 0.25..=4.0_f64,
    })
}

fn any_body() -> impl Strategy<Value = BodyDescription> {
    varied!(BodyDescription {
        name: text(".{0,20}"),
        mesh: hash(),
        pose: pose64(),
        colour: prop::array::uniform4(0.0..=1.0_f32),
    })
}

fn any_screen() -> impl Strategy<Value = ScreenDescription> {
    varied!(ScreenDescription {
        name: text(".{0,20}"),
        lower_left: vector(),
        lower_right: vector(),
        upper_left: vector(),
        output: any_output(),
    })
}

fn any_node() -> impl Strategy<Value = NodeDescription> {
    let stereo = prop::sample::select(vec![
        Stereo::Mono,
        Stereo::SideBySide,
        Stereo::TopBottom,
        Stereo::Anaglyph,
        Stereo::TwoWindows,
    ]);
    let window = varied!(WindowDescription {
        width: 0..=65_536_u32,
        height: 0..=65_536_u32,
        fullscreen: any::<bool>(),
    });
    varied!(NodeDescription {
        name: text(".{0,20}"),
        screens: texts(4),
        stereo,
        window,
        monitors: texts(3),
    })
}

pub fn any_scene() -> impl Strategy<Value = SceneDescription> {
    let scale = || 1e-9..=1.0_f64;
    let show = varied!(Show {
        ghost: any::<bool>(),
        contacts: any::<bool>(),
        force: any::<bool>(),
        hud: any::<bool>(),
        reflections: any::<bool>(),
    });
    varied!(SceneDescription {
        name: text(".{0,40}"),
        revision: any::<u32>(),
        god_object: any_body(),
        obstacles: prop::collection::vec(any_body(), 0..5),
        reference_point: vector(),
        scene_origin: pose64(),
        display_scale: scale(),
        screens: prop::collection::vec(any_screen(), 0..4),
        nodes: prop::collection::vec(any_node(), 0..4),
        viewer: pose64(),
        eye_separation: scale(),
        near: scale(),
        far: scale(),
        separation_scale: scale(),
        nearest_disparity: scale(),
        show,
        environment: prop::option::of(hash()),
    })
}
