//! Every datagram payload.

use proptest::prelude::*;
use taut_proto::{
    Confirmation, ForceSample, HeadSample, InputSample, PassedForce, Payload, PoseF64,
    WrenchCommand,
    confirmation::{MAX_CONFIRMED, SentState},
    events::EventAck,
    path::PathToken,
    time::{TimeRequest, TimeResponse},
};

use super::barrier::{any_arrive, any_release, arrive, release};
use super::constraints::{any_part, part};
use super::hot::{any_hot, hot};
use super::values::{far, finite64, pose64};

pub fn datagrams() -> Vec<(&'static str, Payload)> {
    let input = InputSample {
        sample_time_ns: 1_000_000_000,
        clock_uncertainty_ns: 250_000,
        index: 41,
        pose: PoseF64 {
            position: [0.5, 0.25, -0.125],
            rotation: [1.0, 0.0, 0.0, 0.0],
        },
        velocity: [1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
        buttons: 1,
        flags: 2,
        rendered: [0.0, 0.0, 1.5, 0.0, 0.25, 0.0],
        set_made_ns: 999_000_000,
    };
    let wrench = WrenchCommand {
        time_ns: 1_000_000_500,
        origin_ns: 999_500_000,
        wrench: [0.0, 1.0, 0.0, 0.0, 0.0, 0.5],
        obstacle_work: 0.125,
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
    let force = ForceSample {
        sample_time_ns: 1_000_000_000,
        clock_uncertainty_ns: 250_000,
        index: 44,
        wrench: [1.0, -0.5, 0.25, 0.0, 0.125, 0.0],
    };
    let passed = PassedForce {
        sample: force,
        hold_ns: 20_000_000,
        ramp_out_ns: 95_000_000,
        flags: 2,
    };
    let sent = |tick, state_hash| SentState { tick, state_hash };
    let confirmation = Confirmation {
        asked_ns: 17,
        states: [
            sent(1000, 0x0102_0304_0506_0708),
            sent(999, 9),
            sent(990, 10),
        ]
        .into_iter()
        .collect(),
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
        ("confirm", Payload::Confirm(confirmation)),
        (
            "path_challenge",
            Payload::PathChallenge(PathToken { token: 0x0102 }),
        ),
        (
            "path_response",
            Payload::PathResponse(PathToken { token: 0x0102 }),
        ),
        ("force", Payload::Force(force)),
        ("passed_force", Payload::PassedForce(passed)),
    ]
}

pub fn any_payload() -> impl Strategy<Value = Payload> {
    let six = || {
        prop::collection::vec(finite64(), 6)
            .prop_map(|list| <[f64; 6]>::try_from(list).unwrap_or_default())
    };
    let input = (
        (far(), far(), far(), any::<u16>(), any::<u16>(), far()),
        pose64(),
        six(),
        six(),
    )
        .prop_map(
            |(
                (sample_time_ns, clock_uncertainty_ns, index, buttons, flags, set_made_ns),
                pose,
                velocity,
                rendered,
            )| {
                Payload::Input(InputSample {
                    sample_time_ns,
                    clock_uncertainty_ns,
                    index,
                    pose,
                    velocity,
                    buttons,
                    flags,
                    rendered,
                    set_made_ns,
                })
            },
        );
    let wrench = ((far(), far(), any::<u16>()), six(), -1e9..1e9).prop_map(
        |((time_ns, origin_ns, flags), wrench, obstacle_work)| {
            Payload::Wrench(WrenchCommand {
                time_ns,
                origin_ns,
                wrench,
                obstacle_work,
                flags,
            })
        },
    );
    let response = (far(), far(), far()).prop_map(|(client_sent, server_received, server_sent)| {
        Payload::TimeResponse(TimeResponse {
            client_sent,
            server_received,
            server_sent,
        })
    });
    let head = ((far(), far()), pose64()).prop_map(|((sample_time_ns, index), pose)| {
        Payload::Head(HeadSample {
            sample_time_ns,
            index,
            pose,
        })
    });
    let sample = || {
        ((far(), far(), far()), six()).prop_map(
            |((sample_time_ns, clock_uncertainty_ns, index), wrench)| ForceSample {
                sample_time_ns,
                clock_uncertainty_ns,
                index,
                wrench,
            },
        )
    };
    let passed =
        (sample(), far(), far(), any::<u16>()).prop_map(|(sample, hold_ns, ramp_out_ns, flags)| {
            Payload::PassedForce(PassedForce {
                sample,
                hold_ns,
                ramp_out_ns,
                flags,
            })
        });
    prop_oneof![
        sample().prop_map(Payload::Force),
        passed,
        any_hot().prop_map(Payload::Hot),
        far().prop_map(|client_sent| Payload::TimeRequest(TimeRequest { client_sent })),
        response,
        Just(Payload::Heartbeat),
        input,
        wrench,
        any_part().prop_map(Payload::Constraints),
        head,
        any_arrive().prop_map(Payload::Arrive),
        any_release().prop_map(Payload::Release),
        any_confirmation().prop_map(Payload::Confirm),
        any::<u64>().prop_map(|token| Payload::PathResponse(PathToken { token })),
    ]
}

fn any_confirmation() -> impl Strategy<Value = Confirmation> {
    let older = prop::collection::vec(any::<(u16, u64)>(), 0..=MAX_CONFIRMED);
    (far(), far(), older).prop_map(|(asked_ns, newest, older)| {
        let mut confirmation = Confirmation {
            asked_ns,
            ..Confirmation::default()
        };
        let mut tick = newest;
        for (back, state_hash) in older {
            confirmation.add(SentState { tick, state_hash });
            tick = tick.saturating_sub(u64::from(back.max(1)));
        }
        confirmation
    })
}
