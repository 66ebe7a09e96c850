//! One sample of every datagram payload and control message, and strategies that vary them.
#![allow(
    dead_code,
    unreachable_pub,
    reason = "each test binary uses its own part of the samples"
)]

use proptest::prelude::*;
use taut_proto::{
    ArrayVec, ClientStats, ConstraintPart, ControlMessage, CouplingOffer, EdgeCoupling, EventsTold,
    Group, GroupMember, HeadSample, HotState, InputSample, MeshHash, Payload, PoseF32, PoseF64,
    Refusal, Role, SceneDescription, Transport, WrenchCommand,
    barrier::{Arrive, MAX_MEMBERS, Release, ReleaseHead},
    constraints::{
        ConstraintRow, MAX_PART_ROWS, MAX_PARTS, MAX_SET_ROWS, RowFeature, RowSeparation, SetHead,
    },
    control::{
        ArmRequest, Bye, Hello, LogEvent, LogLevel, MeshHeader, MeshRequest, RefusalCode, StatesBy,
        Welcome,
    },
    coupling::{EdgeAdaptation, EdgeSine, EdgeSolver, EdgeSurface},
    events::EventAck,
    group::GroupSecret,
    proof::Grant,
    scene::{
        BodyDescription, NodeDescription, ScreenDescription, ShowOptions, Stereo, WindowDescription,
    },
    state::{
        BodyState, ContactState, EventRecord, HEAD_TRACKED, HeadState, RunState, ToolState,
        event_code,
    },
    stats::DrawnState,
    time::{TimeRequest, TimeResponse},
};

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

pub fn datagrams() -> Vec<(&'static str, Payload)> {
    let input = InputSample {
        sample_time_ns: 1_000_000_000,
        index: 41,
        pose: PoseF64 {
            position: [0.5, 0.25, -0.125],
            rotation: [1.0, 0.0, 0.0, 0.0],
        },
        velocity: [1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
        buttons: 1,
        flags: 2,
        rendered: [0.0, 0.0, 1.5, 0.0, 0.25, 0.0],
        set_sequence: 40,
    };
    let wrench = WrenchCommand {
        time_ns: 1_000_000_500,
        input_index: 41,
        wrench: [0.0, 1.0, 0.0, 0.0, 0.0, 0.5],
        flags: 0,
    };
    let head = HeadSample {
        sample_time_ns: 1_000_000_000,
        index: 43,
        pose: PoseF64 {
            position: [0.0, -1.25, 0.875],
            rotation: [0.5, 0.5, 0.5, 0.5],
        },
    };
    let response = TimeResponse {
        client_sent: 17,
        server_received: 1017,
        server_sent: 1020,
    };
    vec![
        ("hot", Payload::Hot(hot())),
        (
            "time_request",
            Payload::TimeRequest(TimeRequest { client_sent: 17 }),
        ),
        ("time_response", Payload::TimeResponse(response)),
        ("heartbeat", Payload::Heartbeat),
        ("input", Payload::Input(input)),
        ("wrench", Payload::Wrench(wrench)),
        ("constraints", Payload::Constraints(part())),
        ("head", Payload::Head(head)),
        ("arrive", Payload::Arrive(arrive())),
        ("release", Payload::Release(release())),
        ("event_ack", Payload::EventAck(EventAck { newest: 17 })),
    ]
}

pub fn arrive() -> Arrive {
    Arrive {
        term: 1,
        frame: 1001,
        ready_ns: 16_000_000_000,
        state_hash: 0x0102_0304_0506_0708,
        state_time_ns: 15_990_000_000,
        missed: 3,
        swapped_frame: 1000,
        swapped_ns: 15_995_000_000,
        draw_us: 4200,
        period_us: 8333,
    }
}

pub fn release() -> Release {
    Release {
        head: ReleaseHead {
            term: 1,
            master: 0,
            frame: 1001,
            swap_ns: 16_000_300_000,
            period_us: 16_667,
            skew_ns: 12_000,
            waited: 0b01,
            late: 0b10,
            members: ArrayVec::from_iter([3, 9]),
        },
        state: hot(),
    }
}

/// A part with a row of every kind.
pub fn part() -> ConstraintPart {
    let plain = ConstraintRow {
        obstacle: 2,
        on_body: RowFeature { kind: 0, index: 7 },
        on_obstacle: RowFeature { kind: 2, index: 9 },
        arm: [0.5, 0.25, -0.125],
        normal: [0.0, 0.0, 1.0],
        gap: 0.000_976_562_5,
        ..ConstraintRow::default()
    };
    let along = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let of = |separation| ConstraintRow {
        separation,
        ..plain
    };
    ConstraintPart {
        head: SetHead {
            sequence: 40,
            made_ns: 1_000_000_900,
            device_ns: 1_000_000_000,
            pose: PoseF64 {
                position: [0.5, 0.25, -0.125],
                rotation: [1.0, 0.0, 0.0, 0.0],
            },
            flags: 1,
        },
        rows_in_set: 9,
        part: 1,
        parts: 2,
        first_row: 2,
        rows: ArrayVec::from_iter([
            plain,
            of(RowSeparation::OfBody),
            of(RowSeparation::OfEdges(along)),
            of(RowSeparation::OfBall(0.25)),
            of(RowSeparation::OfRim([0.5; 3], [0.0, 0.0, 1.0], 0.125)),
            of(RowSeparation::OfRods(along, [0.5, 0.25])),
            ConstraintRow {
                came: 0.5,
                shading_normal: Some([0.0, 0.5, 0.5]),
                ..plain
            },
        ]),
    }
}

pub fn coupling() -> EdgeCoupling {
    EdgeCoupling {
        mass: 1.0,
        inertia: [0.5, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.25],
        reference_point: [0.0, 0.0, 0.5],
        radius: 0.125,
        k_s: 0.5,
        k_h: 2000.0,
        radius_of_gyration: Some(0.0625),
        adaptation: Some(EdgeAdaptation {
            duration: 0.015_625,
            threshold: -0.000_976_562_5,
        }),
        look_ahead: true,
        passive: false,
        force_limit: 20.0,
        torque_limit: 0.5,
        rest_distance: 0.000_007_629_394_531_25,
        motion_tolerance: 0.000_000_029_802_322_387_695_312,
        max_constraints: 1024,
        implicit_rounds: 2,
        solver: EdgeSolver::ActiveSet,
        set_rate_hz: 1000.0,
        obstacles: vec![EdgeSurface {
            pose: PoseF64::IDENTITY,
            friction: 0.25,
            sine: Some(EdgeSine {
                axis: [1.0, 0.0, 0.0],
                wavelength: 0.001_953_125,
                amplitude: 0.125,
            }),
        }],
    }
}

pub fn scene() -> SceneDescription {
    let body = |name: &str, byte: u8| BodyDescription {
        name: name.to_owned(),
        mesh: MeshHash { bytes: [byte; 32] },
        pose: PoseF64::IDENTITY,
        colour: [1.0, 0.5, 0.25, 1.0],
    };
    SceneDescription {
        name: "peg".to_owned(),
        revision: 7,
        god_object: body("peg", 1),
        obstacles: vec![body("box", 2)],
        reference_point: [0.0, 0.0, 0.5],
        scene_origin: PoseF64::IDENTITY,
        display_scale: 2.0,
        screens: vec![ScreenDescription {
            name: "front".to_owned(),
            lower_left: [-1.0, 1.0, 0.0],
            lower_right: [1.0, 1.0, 0.0],
            upper_left: [-1.0, 1.0, 1.0],
        }],
        nodes: vec![NodeDescription {
            name: "left".to_owned(),
            screens: vec!["front".to_owned()],
            stereo: Stereo::SideBySide,
            window: WindowDescription {
                width: 640,
                height: 480,
                fullscreen: true,
            },
            monitors: vec!["DP-1".to_owned(), "1".to_owned()],
        }],
        viewer: PoseF64::IDENTITY,
        eye_separation: 0.0625,
        near: 0.125,
        far: 8.0,
        separation_scale: 0.75,
        nearest_disparity: 0.0625,
        show: ShowOptions {
            ghost: true,
            contacts: false,
            force: true,
            hud: true,
        },
    }
}

pub fn messages() -> Vec<(&'static str, ControlMessage)> {
    let refusal = Refusal {
        code: RefusalCode::NameTaken,
        version: 1,
        text: "taken".to_owned(),
    };
    let hello = Hello {
        node: "left".to_owned(),
        role: Role::Render,
        transport: Transport::QuicDatagram,
        rate_hz: 1000,
        proof: [3; 32],
        grant: Grant::Master,
    };
    let granted = Hello {
        role: Role::Tracker,
        grant: Grant::Node { issue: 2 },
        ..hello.clone()
    };
    let welcome = Welcome {
        proof: [4; 32],
        session: 2,
        epoch: 0xdead_beef,
        udp_port: 4858,
        session_time_ns: 1_000_000_000,
        node_timeout_ms: 500,
    };
    let stats = ClientStats {
        frames: 600,
        fps: 59.5,
        pose_age_ms_p50: 4.0,
        pose_age_ms_p99: 8.0,
        pose_age_ms_max: 16.0,
        drawn_age_ms_p50: 12.0,
        drawn_age_ms_p99: 24.0,
        drawn_age_ms_max: 32.0,
        swap_skew_ms_p50: 0.5,
        swap_skew_ms_max: 1.5,
        packets_lost: 1,
        packets_received: 10_000,
        clock_uncertainty_ns: 25_000,
        drawn: vec![DrawnState {
            tick: 1000,
            state_hash: 0x0123_4567_89ab_cdef,
        }],
    };
    let hash = MeshHash { bytes: [1; 32] };
    let log = LogEvent {
        level: LogLevel::Warning,
        text: "software rendering".to_owned(),
    };
    vec![
        ("refused", ControlMessage::Refused(refusal)),
        ("hello", ControlMessage::Hello(hello)),
        ("welcome", ControlMessage::Welcome(welcome)),
        ("scene", ControlMessage::Scene(scene())),
        (
            "mesh_request",
            ControlMessage::MeshRequest(MeshRequest { hash }),
        ),
        (
            "mesh_header",
            ControlMessage::MeshHeader(MeshHeader { hash, length: 4096 }),
        ),
        ("stats", ControlMessage::Stats(stats)),
        ("log", ControlMessage::Log(log)),
        (
            "coupling_at_edge",
            ControlMessage::Coupling(CouplingOffer::AtEdge(coupling())),
        ),
        (
            "coupling_at_server",
            ControlMessage::Coupling(CouplingOffer::AtServer {
                reason: "a height map".to_owned(),
            }),
        ),
        (
            "bye",
            ControlMessage::Bye(Bye {
                reason: "done".to_owned(),
            }),
        ),
        ("arm", ControlMessage::Arm(ArmRequest { arm: true })),
        ("group", ControlMessage::Group(group())),
        ("hello_granted", ControlMessage::Hello(granted)),
        (
            "events",
            ControlMessage::Events(EventsTold {
                after: 16,
                records: hot().events.to_vec(),
            }),
        ),
        (
            "states_by",
            ControlMessage::StatesBy(StatesBy { multicast: true }),
        ),
    ]
}

/// Three members, one of each kind of address.
pub fn group() -> Group {
    let member = |sender: u16, node: &str, role, address: Option<&str>| GroupMember {
        sender,
        node: node.to_owned(),
        role,
        address: address.and_then(|address| address.parse().ok()),
    };
    Group {
        generation: 9,
        secret: GroupSecret([5; 32]),
        members: vec![
            member(1, "left", Role::Render, Some("192.168.7.2:40001")),
            member(2, "right", Role::Render, Some("[fd00::2]:40002")),
            member(5, "watcher", Role::Observer, None),
        ],
        multicast: "239.255.72.87:4859".parse().ok(),
    }
}

fn finite32() -> impl Strategy<Value = f32> {
    prop::num::f32::NORMAL | prop::num::f32::ZERO | prop::num::f32::SUBNORMAL
}

fn finite64() -> impl Strategy<Value = f64> {
    prop::num::f64::NORMAL | prop::num::f64::ZERO | prop::num::f64::SUBNORMAL
}

fn pose32() -> impl Strategy<Value = PoseF32> {
    (
        prop::array::uniform3(finite32()),
        prop::array::uniform4(finite32()),
    )
        .prop_map(|(position, rotation)| PoseF32 { position, rotation })
}

fn pose64() -> impl Strategy<Value = PoseF64> {
    (
        prop::array::uniform3(finite64()),
        prop::array::uniform4(finite64()),
    )
        .prop_map(|(position, rotation)| PoseF64 { position, rotation })
}

fn list<T: std::fmt::Debug, const N: usize>(
    element: impl Strategy<Value = T>,
) -> impl Strategy<Value = ArrayVec<T, N>> {
    prop::collection::vec(element, 0..=N).prop_map(ArrayVec::from_iter)
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

pub fn any_hot() -> impl Strategy<Value = HotState> {
    let run = prop::sample::select(vec![
        RunState::Waiting,
        RunState::Running,
        RunState::Paused,
        RunState::Fault,
    ]);
    let head = (pose32(), any::<i32>(), finite32(), any::<u32>()).prop_map(
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
        any::<(u64, u64, u32, u32)>(),
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

pub fn any_payload() -> impl Strategy<Value = Payload> {
    let six = || {
        prop::collection::vec(finite64(), 6)
            .prop_map(|list| <[f64; 6]>::try_from(list).unwrap_or_default())
    };
    let input = (any::<(u64, u64, u16, u16, u64)>(), pose64(), six(), six()).prop_map(
        |((sample_time_ns, index, buttons, flags, set_sequence), pose, velocity, rendered)| {
            Payload::Input(InputSample {
                sample_time_ns,
                index,
                pose,
                velocity,
                buttons,
                flags,
                rendered,
                set_sequence,
            })
        },
    );
    let wrench =
        (any::<(u64, u64, u16)>(), six()).prop_map(|((time_ns, input_index, flags), wrench)| {
            Payload::Wrench(WrenchCommand {
                time_ns,
                input_index,
                wrench,
                flags,
            })
        });
    let response =
        any::<(u64, u64, u64)>().prop_map(|(client_sent, server_received, server_sent)| {
            Payload::TimeResponse(TimeResponse {
                client_sent,
                server_received,
                server_sent,
            })
        });
    let head = (any::<(u64, u64)>(), pose64()).prop_map(|((sample_time_ns, index), pose)| {
        Payload::Head(HeadSample {
            sample_time_ns,
            index,
            pose,
        })
    });
    prop_oneof![
        any_hot().prop_map(Payload::Hot),
        any::<u64>().prop_map(|client_sent| Payload::TimeRequest(TimeRequest { client_sent })),
        response,
        Just(Payload::Heartbeat),
        input,
        wrench,
        any_part().prop_map(Payload::Constraints),
        head,
        any_arrive().prop_map(Payload::Arrive),
        any_release().prop_map(Payload::Release),
    ]
}

pub fn any_arrive() -> impl Strategy<Value = Arrive> {
    (
        any::<(u32, u64, u64, u64, u64)>(),
        any::<(u32, u64, u64, u32, u32)>(),
    )
        .prop_map(
            |(
                (term, frame, ready_ns, state_hash, state_time_ns),
                (missed, swapped_frame, swapped_ns, draw_us, period_us),
            )| Arrive {
                term,
                frame,
                ready_ns,
                state_hash,
                state_time_ns,
                missed,
                swapped_frame,
                swapped_ns,
                draw_us,
                period_us,
            },
        )
}

pub fn any_release() -> impl Strategy<Value = Release> {
    let members = prop::collection::btree_set(any::<u16>(), 0..=MAX_MEMBERS);
    (
        any::<(u32, u16, u64, u64, u32, u32, u32, u32)>(),
        members,
        any_hot(),
    )
        .prop_map(
            |((term, master, frame, swap_ns, period_us, skew_ns, waited, late), members, state)| {
                Release {
                    head: ReleaseHead {
                        term,
                        master,
                        frame,
                        swap_ns,
                        period_us,
                        skew_ns,
                        waited,
                        late,
                        members: members.into_iter().collect(),
                    },
                    state,
                }
            },
        )
}

pub fn any_row() -> impl Strategy<Value = ConstraintRow> {
    let three = || prop::array::uniform3(finite32());
    let two = move || prop::array::uniform2(three());
    let separation = prop_oneof![
        Just(RowSeparation::OfObstacle),
        Just(RowSeparation::OfBody),
        two().prop_map(RowSeparation::OfEdges),
        finite32().prop_map(RowSeparation::OfBall),
        (three(), three(), finite32()).prop_map(|(c, a, r)| RowSeparation::OfRim(c, a, r)),
        (two(), prop::array::uniform2(finite32())).prop_map(|(u, r)| RowSeparation::OfRods(u, r)),
    ];
    let feature = || (0_u8..16, any::<u32>()).prop_map(|(kind, index)| RowFeature { kind, index });
    let came = prop_oneof![Just(0.0_f32), prop::num::f32::NORMAL];
    (
        any::<u16>(),
        (feature(), feature()),
        (three(), three(), finite32(), came),
        separation,
        prop::option::of(three()),
    )
        .prop_map(
            |(obstacle, (on_body, on_obstacle), (arm, normal, gap, came), separation, shading)| {
                ConstraintRow {
                    obstacle,
                    on_body,
                    on_obstacle,
                    arm,
                    normal,
                    gap,
                    came,
                    separation,
                    shading_normal: shading,
                }
            },
        )
}

/// As many rows as a datagram surely holds, at any place of a set.
pub fn any_part() -> impl Strategy<Value = ConstraintPart> {
    (
        any::<(u64, u64, u64)>(),
        pose64(),
        0_u8..4,
        (1..=MAX_PARTS as u8).prop_flat_map(|parts| (0..parts, Just(parts))),
        prop::collection::vec(any_row(), 0..=11.min(MAX_PART_ROWS)),
        (0..=MAX_SET_ROWS as u16 - 11).prop_flat_map(|first| (Just(first), 0..=first)),
    )
        .prop_map(
            |(
                (sequence, made_ns, device_ns),
                pose,
                flags,
                (part, parts),
                rows,
                (before, after),
            )| {
                let first_row = before - after;
                ConstraintPart {
                    head: SetHead {
                        sequence,
                        made_ns,
                        device_ns,
                        pose,
                        flags,
                    },
                    rows_in_set: first_row + rows.len() as u16 + after,
                    part,
                    parts,
                    first_row,
                    rows: ArrayVec::from_iter(rows),
                }
            },
        )
}

pub fn any_scene() -> impl Strategy<Value = SceneDescription> {
    let body = || {
        (
            ".{0,20}",
            any::<[u8; 32]>(),
            pose64(),
            prop::array::uniform4(finite32()),
        )
            .prop_map(|(name, bytes, pose, colour)| BodyDescription {
                name,
                mesh: MeshHash { bytes },
                pose,
                colour,
            })
    };
    let corner = || prop::array::uniform3(finite64());
    let screen = (".{0,20}", corner(), corner(), corner()).prop_map(
        |(name, lower_left, lower_right, upper_left)| ScreenDescription {
            name,
            lower_left,
            lower_right,
            upper_left,
        },
    );
    let stereo = prop::sample::select(vec![
        Stereo::Mono,
        Stereo::SideBySide,
        Stereo::TopBottom,
        Stereo::Anaglyph,
        Stereo::TwoWindows,
    ]);
    let node = (
        ".{0,20}",
        prop::collection::vec(".{0,9}", 0..4),
        stereo,
        any::<(u32, u32, bool)>(),
        prop::collection::vec(".{0,9}", 0..3),
    )
        .prop_map(
            |(name, screens, stereo, (width, height, fullscreen), monitors)| NodeDescription {
                name,
                screens,
                stereo,
                window: WindowDescription {
                    width,
                    height,
                    fullscreen,
                },
                monitors,
            },
        );
    let lists = (
        prop::collection::vec(body(), 0..5),
        prop::collection::vec(screen, 0..4),
        prop::collection::vec(node, 0..4),
    );
    let numbers = (
        prop::array::uniform6(finite64()),
        prop::array::uniform3(finite64()),
        any::<(u32, bool, bool, bool, bool)>(),
    );
    (".{0,40}", body(), lists, (pose64(), pose64()), numbers).prop_map(
        |(
            name,
            god_object,
            (obstacles, screens, nodes),
            (scene_origin, viewer),
            (scalars, reference_point, (revision, ghost, contacts, force, hud)),
        )| {
            let [
                display_scale,
                eye_separation,
                near,
                far,
                separation_scale,
                nearest_disparity,
            ] = scalars;
            SceneDescription {
                name,
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
                show: ShowOptions {
                    ghost,
                    contacts,
                    force,
                    hud,
                },
            }
        },
    )
}
