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
    let asked = TimeRequest { client_sent: 17 };
    let response = TimeResponse {
        client_sent: 17,
        server_received: 1017,
        server_sent: 1020,
    };
    let passed = PassedForce {
        sample: force(),
        hold_ns: 20_000_000,
        ramp_out_ns: 95_000_000,
        flags: 2,
    };
    let ack = EventAck { newest: 17 };
    let token = PathToken { token: 0x0102 };
    vec![
        ("hot", Payload::Hot(hot())),
        ("time_request", Payload::TimeRequest(asked)),
        ("time_response", Payload::TimeResponse(response)),
        ("heartbeat", Payload::Heartbeat),
        ("input", Payload::Input(input())),
        ("wrench", Payload::Wrench(wrench())),
        ("constraints", Payload::Constraints(part())),
        ("head", Payload::Head(head())),
        ("arrive", Payload::Arrive(arrive())),
        ("release", Payload::Release(release())),
        ("event_ack", Payload::EventAck(ack)),
        ("confirm", Payload::Confirm(confirmation())),
        ("path_challenge", Payload::PathChallenge(token)),
        ("path_response", Payload::PathResponse(token)),
        ("force", Payload::Force(force())),
        ("passed_force", Payload::PassedForce(passed)),
    ]
}

fn input() -> InputSample {
    InputSample {
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
    }
}

fn wrench() -> WrenchCommand {
    WrenchCommand {
        time_ns: 1_000_000_500,
        origin_ns: 999_500_000,
        wrench: [0.0, 1.0, 0.0, 0.0, 0.0, 0.5],
        obstacle_work: 0.125,
        flags: 0,
    }
}

fn head() -> HeadSample {
    HeadSample {
        sample_time_ns: 1_000_000_000,
        index: 43,
        pose: PoseF64 {
            position: [0.0, -1.25, 0.875],
            rotation: [0.5, 0.5, 0.5, 0.5],
        },
    }
}

fn force() -> ForceSample {
    ForceSample {
        sample_time_ns: 1_000_000_000,
        clock_uncertainty_ns: 250_000,
        index: 44,
        wrench: [1.0, -0.5, 0.25, 0.0, 0.125, 0.0],
    }
}

fn confirmation() -> Confirmation {
    let states = [(1000, 0x0102_0304_0506_0708), (999, 9), (990, 10)];
    let sent = states.map(|(tick, state_hash)| SentState { tick, state_hash });
    Confirmation {
        asked_ns: 17,
        states: sent.into_iter().collect(),
    }
}

pub fn any_payload() -> impl Strategy<Value = Payload> {
    let response = varied!(TimeResponse {
        client_sent: far(),
        server_received: far(),
        server_sent: far(),
    });
    let head = varied!(HeadSample {
        sample_time_ns: far(),
        index: far(),
        pose: pose64(),
    });
    let passed = varied!(PassedForce {
        sample: any_force(),
        hold_ns: far(),
        ramp_out_ns: far(),
        flags: any::<u16>(),
    });
    prop_oneof![
        any_force().prop_map(Payload::Force),
        passed.prop_map(Payload::PassedForce),
        any_hot().prop_map(Payload::Hot),
        far().prop_map(|client_sent| Payload::TimeRequest(TimeRequest { client_sent })),
        response.prop_map(Payload::TimeResponse),
        Just(Payload::Heartbeat),
        any_input().prop_map(Payload::Input),
        any_wrench().prop_map(Payload::Wrench),
        any_part().prop_map(Payload::Constraints),
        head.prop_map(Payload::Head),
        any_arrive().prop_map(Payload::Arrive),
        any_release().prop_map(Payload::Release),
        any_confirmation().prop_map(Payload::Confirm),
        any::<u64>().prop_map(|token| Payload::PathResponse(PathToken { token })),
    ]
}

fn six() -> impl Strategy<Value = [f64; 6]> {
    prop::collection::vec(finite64(), 6)
        .prop_map(|list| <[f64; 6]>::try_from(list).unwrap_or_default())
}

fn any_input() -> impl Strategy<Value = InputSample> {
    varied!(InputSample {
        sample_time_ns: far(),
        clock_uncertainty_ns: far(),
        index: far(),
        pose: pose64(),
        velocity: six(),
        buttons: any::<u16>(),
        flags: any::<u16>(),
        rendered: six(),
        set_made_ns: far(),
    })
}

fn any_wrench() -> impl Strategy<Value = WrenchCommand> {
    varied!(WrenchCommand {
        time_ns: far(),
        origin_ns: far(),
        wrench: six(),
        obstacle_work: -1e9..1e9,
        flags: any::<u16>(),
    })
}

fn any_force() -> impl Strategy<Value = ForceSample> {
    varied!(ForceSample {
        sample_time_ns: far(),
        clock_uncertainty_ns: far(),
        index: far(),
        wrench: six(),
    })
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
