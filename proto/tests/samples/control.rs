//! Every control message.

use taut_proto::{
    ClientStats, ControlMessage, CouplingOffer, EventBatch, MeshHash, PROTOCOL_VERSION, Refusal,
    Role, Transport, VersionRange,
    control::{
        ArmRequest, Bye, Hello, LogEvent, LogLevel, MeshHeader, MeshRequest, NoPicture, Offers,
        PictureHeader, PictureRequest, RefusalCode, StatesBy, Welcome,
    },
    proof::Grant,
    stats::DrawnState,
};

use super::coupling::coupling;
use super::group::group;
use super::hot::hot;
use super::scene::scene;

pub fn messages() -> Vec<(&'static str, ControlMessage)> {
    let refusal = Refusal {
        code: RefusalCode::NameTaken,
        version: 1,
        text: "taken".into(),
    };
    let granted = Hello {
        role: Role::Tracker,
        grant: Grant::Node { issue: 2 },
        ..hello()
    };
    let offering = Hello {
        offers: Offers::PICTURES,
        ..hello()
    };
    let hash = MeshHash { bytes: [1; 32] };
    let wanted = MeshRequest { hash };
    let mesh = MeshHeader { hash, length: 4096 };
    let log = LogEvent {
        level: LogLevel::Warning,
        text: "software rendering".into(),
    };
    let bye = Bye {
        reason: "done".into(),
    };
    let events = EventBatch {
        after: 16,
        records: hot().events.to_vec(),
    };
    let by = StatesBy {
        multicast: true,
        forged: false,
    };
    let asked = PictureRequest { longest_edge: 640 };
    let none = NoPicture {
        reason: "no frame was shown".into(),
    };
    let at_edge = CouplingOffer::AtEdge(coupling());
    let at_server = CouplingOffer::AtServer {
        reason: "a height map".into(),
    };
    vec![
        ("refused", ControlMessage::Refused(refusal)),
        ("hello", ControlMessage::Hello(hello())),
        ("welcome", ControlMessage::Welcome(welcome())),
        ("scene", ControlMessage::Scene(scene())),
        ("mesh_request", ControlMessage::MeshRequest(wanted)),
        ("mesh_header", ControlMessage::MeshHeader(mesh)),
        ("stats", ControlMessage::Stats(stats())),
        ("log", ControlMessage::Log(log)),
        ("coupling_at_edge", ControlMessage::Coupling(at_edge)),
        ("coupling_at_server", ControlMessage::Coupling(at_server)),
        ("bye", ControlMessage::Bye(bye)),
        ("arm", ControlMessage::Arm(ArmRequest { arm: true })),
        ("group", ControlMessage::Group(group())),
        ("hello_granted", ControlMessage::Hello(granted)),
        ("events", ControlMessage::Events(events)),
        ("states_by", ControlMessage::StatesBy(by)),
        ("hello_with_pictures", ControlMessage::Hello(offering)),
        ("picture_request", ControlMessage::PictureRequest(asked)),
        ("picture_header", ControlMessage::PictureHeader(picture())),
        ("no_picture", ControlMessage::NoPicture(none)),
    ]
}

fn hello() -> Hello {
    Hello {
        versions: VersionRange::SUPPORTED,
        node: "left".into(),
        role: Role::Render,
        transport: Transport::QuicDatagram,
        rate_hz: 1000,
        proof: [3; 32],
        grant: Grant::Master,
        offers: Offers::NONE,
    }
}

fn welcome() -> Welcome {
    Welcome {
        version: PROTOCOL_VERSION,
        proof: [4; 32],
        session: 2,
        epoch: 0xdead_beef,
        udp_port: 4858,
        session_time_ns: 1_000_000_000,
        node_timeout_ms: 500,
    }
}

fn stats() -> ClientStats {
    ClientStats {
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
    }
}

fn picture() -> PictureHeader {
    PictureHeader {
        screen: "wall-left".into(),
        shown_ns: 2_000_000_000,
        width: 640,
        height: 360,
        length: 70_000,
        more: true,
    }
}
