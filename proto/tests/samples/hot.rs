//! The state that is broadcast.

use proptest::prelude::*;
use taut_proto::{
    ArrayVec, HotState, PoseF32,
    state::{
        BodyState, ContactState, EventRecord, HEAD_TRACKED, HeadState, RunState, ToolState,
        event_code,
    },
};

use super::values::{far, finite32, list, pose32};

pub fn hot() -> HotState {
    let pose = PoseF32 {
        position: [0.25, -0.5, 1.0],
        rotation: [0.0, 1.0, 0.0, 0.0],
    };
    HotState {
        sample_time_ns: 1_000_000_007,
        tick: 1000,
        scene_revision: 7,
        run: RunState::Running,
        constraint_age_us: 850,
        head: HeadState {
            pose,
            age_us: -12,
            eye_separation: 0.0625,
            flags: HEAD_TRACKED,
        },
        tools: ArrayVec::from_iter([ToolState {
            god_object: pose,
            device: PoseF32::IDENTITY,
            linear_velocity: [0.5, 0.0, 0.0],
            angular_velocity: [0.0, 0.5, 0.0],
            force: [0.0, 2.0, 0.0],
            torque: [0.0, 0.0, 0.125],
            buttons: 3,
            flags: 1,
            id: 0,
        }]),
        bodies: ArrayVec::from_iter([BodyState {
            id: 2,
            flags: 0,
            pose,
        }]),
        contacts: ArrayVec::from_iter([ContactState {
            pair: [0, 2],
            point: [0.5, 0.25, 0.125],
            normal: [0.0, 0.0, -1.0],
            force: 1.5,
            gap: 0.000_976_562_5,
        }]),
        events: ArrayVec::from_iter([EventRecord {
            id: 9,
            tick: 998,
            code: event_code::CONTACT_ON,
        }]),
    }
}

pub fn any_hot() -> impl Strategy<Value = HotState> {
    let run = prop::sample::select(vec![
        RunState::Waiting,
        RunState::Running,
        RunState::Paused,
        RunState::Fault,
    ]);
    let head = (pose32(), any::<i32>(), 0.0..=1.0_f32, any::<u32>()).prop_map(
        |(pose, age_us, eye_separation, flags)| HeadState {
            pose,
            age_us,
            eye_separation,
            flags,
        },
    );
    let body = (any::<(u16, u16)>(), pose32()).prop_map(|((id, flags), pose)| BodyState {
        id,
        flags,
        pose,
    });
    let event =
        any::<(u32, u32, u32)>().prop_map(|(id, tick, code)| EventRecord { id, tick, code });
    (
        (far(), far(), any::<u32>(), any::<u32>()),
        run,
        head,
        list(tool()),
        list(body),
        list(contact()),
        list(event),
    )
        .prop_map(
            |(
                (sample_time_ns, tick, scene_revision, constraint_age_us),
                run,
                head,
                tools,
                bodies,
                contacts,
                events,
            )| HotState {
                sample_time_ns,
                tick,
                scene_revision,
                run,
                constraint_age_us,
                head,
                tools,
                bodies,
                contacts,
                events,
            },
        )
}

fn tool() -> impl Strategy<Value = ToolState> {
    let vectors = prop::array::uniform4(prop::array::uniform3(finite32()));
    (pose32(), pose32(), vectors, any::<(u16, u16, u32)>()).prop_map(
        |(god_object, device, vectors, (buttons, flags, id))| {
            let [linear_velocity, angular_velocity, force, torque] = vectors;
            ToolState {
                god_object,
                device,
                linear_velocity,
                angular_velocity,
                force,
                torque,
                buttons,
                flags,
                id,
            }
        },
    )
}

/// Contacts with normals that survive the rounding unchanged: the axes.
fn contact() -> impl Strategy<Value = ContactState> {
    let axes = [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]];
    let normal = prop::sample::select(axes.to_vec());
    (
        any::<[u16; 2]>(),
        prop::array::uniform3(finite32()),
        normal,
        finite32(),
        finite32(),
    )
        .prop_map(|(pair, point, normal, force, gap)| ContactState {
            pair,
            point,
            normal,
            force,
            gap,
        })
}
