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
    let head = varied!(HeadState {
        pose: pose32(),
        age_us: any::<i32>(),
        eye_separation: 0.0..=1.0_f32,
        flags: any::<u32>(),
    });
    let body = varied!(BodyState {
        id: any::<u16>(),
        flags: any::<u16>(),
        pose: pose32(),
    });
    let event = varied!(EventRecord {
        id: any::<u32>(),
        tick: any::<u32>(),
        code: any::<u32>(),
    });
    varied!(HotState {
        sample_time_ns: far(),
        tick: far(),
        scene_revision: any::<u32>(),
        run,
        constraint_age_us: any::<u32>(),
        head,
        tools: list(tool()),
        bodies: list(body),
        contacts: list(contact()),
        events: list(event),
    })
}

fn tool() -> impl Strategy<Value = ToolState> {
    varied!(ToolState {
        god_object: pose32(),
        device: pose32(),
        linear_velocity: vector(),
        angular_velocity: vector(),
        force: vector(),
        torque: vector(),
        buttons: any::<u16>(),
        flags: any::<u16>(),
        id: any::<u32>(),
    })
}

fn vector() -> impl Strategy<Value = [f32; 3]> {
    prop::array::uniform3(finite32())
}

/// Contacts with normals that survive the rounding unchanged: the axes.
fn contact() -> impl Strategy<Value = ContactState> {
    let axes = [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]];
    varied!(ContactState {
        pair: any::<[u16; 2]>(),
        point: vector(),
        normal: prop::sample::select(axes.to_vec()),
        force: finite32(),
        gap: finite32(),
    })
}
