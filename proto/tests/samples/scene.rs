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

fn any_output() -> impl Strategy<Value = OutputDescription> {
    let files = || {
        prop::collection::vec(".{0,9}", 0..3)
            .prop_map(|names| names.into_iter().map(Untrusted::from).collect())
    };
    let numbers = (
        0.1..=8.0_f64,
        prop::collection::vec(-16.0..=16.0_f64, 9),
        prop::array::uniform3(0.0..=8.0_f64),
        0.25..=4.0_f64,
    );
    (files(), files(), files(), numbers).prop_map(
        |(warp, surface, blend, (blend_gamma, colour, gamma, sampling))| OutputDescription {
            warp,
            surface,
            blend,
            blend_gamma,
            colour: std::array::from_fn(|i| colour[i]),
            gamma,
            sampling,
        },
    )
}

fn any_body() -> impl Strategy<Value = BodyDescription> {
    let colour = prop::array::uniform4(0.0..=1.0_f32);
    let parts = (".{0,20}", any::<[u8; 32]>(), pose64(), colour);
    parts.prop_map(|(name, bytes, pose, colour)| BodyDescription {
        name: name.into(),
        mesh: MeshHash { bytes },
        pose,
        colour,
    })
}

fn any_screen() -> impl Strategy<Value = ScreenDescription> {
    let corner = || prop::array::uniform3(finite64());
    (".{0,20}", corner(), corner(), corner(), any_output()).prop_map(
        |(name, lower_left, lower_right, upper_left, output)| ScreenDescription {
            name: name.into(),
            lower_left,
            lower_right,
            upper_left,
            output,
        },
    )
}

fn any_node() -> impl Strategy<Value = NodeDescription> {
    let stereo = prop::sample::select(vec![
        Stereo::Mono,
        Stereo::SideBySide,
        Stereo::TopBottom,
        Stereo::Anaglyph,
        Stereo::TwoWindows,
    ]);
    let window =
        (0..=65_536_u32, 0..=65_536_u32, any::<bool>()).prop_map(|(width, height, fullscreen)| {
            WindowDescription {
                width,
                height,
                fullscreen,
            }
        });
    let names = |most| prop::collection::vec(".{0,9}", 0..most);
    (".{0,20}", names(4), stereo, window, names(3)).prop_map(
        |(name, screens, stereo, window, monitors)| NodeDescription {
            name: name.into(),
            screens: screens.into_iter().map(Untrusted::from).collect(),
            stereo,
            window,
            monitors: monitors.into_iter().map(Untrusted::from).collect(),
        },
    )
}

pub fn any_scene() -> impl Strategy<Value = SceneDescription> {
    let lists = (
        prop::collection::vec(any_body(), 0..5),
        prop::collection::vec(any_screen(), 0..4),
        prop::collection::vec(any_node(), 0..4),
    );
    let numbers = (
        prop::array::uniform6(1e-9..=1.0_f64),
        prop::array::uniform3(finite64()),
        any::<(u32, [bool; 5], Option<[u8; 32]>)>(),
    );
    (".{0,40}", any_body(), lists, (pose64(), pose64()), numbers).prop_map(
        |(
            name,
            god_object,
            (obstacles, screens, nodes),
            (scene_origin, viewer),
            (scalars, reference_point, (revision, shown, environment)),
        )| {
            let [
                display_scale,
                eye_separation,
                near,
                far,
                separation_scale,
                nearest_disparity,
            ] = scalars;
            let [ghost, contacts, force, hud, reflections] = shown;
            SceneDescription {
                name: name.into(),
                revision,
                god_object,
                obstacles,
                reference_point,
                scene_origin,
                display_scale,
                screens,
                nodes,
                viewer,
                eye_separation,
                near,
                far,
                separation_scale,
                nearest_disparity,
                show: Show {
                    ghost,
                    contacts,
                    force,
                    hud,
                    reflections,
                },
                environment: environment.map(|bytes| MeshHash { bytes }),
            }
        },
    )
}
