//! Bytes that a VRPN 07.38 server sent (its `vrpn_server` with the spinning tracker `Tracker0` and the button device
//! `Button0` of its own examples), message by message, and what the client makes of them.

use taut_vrpn::{ButtonStates, Client, Event, SensorMapping, Version};

/// What was sent, in hexadecimal digits.
const SENT: [&str; 11] = [
    // Greeting.
    "7672706e3a207665722e2030372e33382020300000000000",
    // Tracker0 is sender 1.
    "000000256b01b2fd0000047000000001ffffffff0000000100000009547261636b65723000000000",
    // Button0 is sender 3.
    "000000246b01b2fd0000047100000003ffffffff0000000300000008427574746f6e300000000000",
    // Pos_Quat is type 4.
    "000000326b01b2fd0000047200000004fffffffe00000009000000167672706e5f547261636b657220506f735f517561\
     7400000000000000",
    // Velocity is type 5.
    "000000326b01b2fd0000047200000005fffffffe0000000a000000167672706e5f547261636b65722056656c6f636974\
     7900000000000000",
    // Change is type 18.
    "0000002f6b01b2fd0000047200000012fffffffe00000017000000137672706e5f427574746f6e204368616e67650000",
    // States is type 19.
    "0000002f6b01b2fd0000047200000013fffffffe00000018000000137672706e5f427574746f6e205374617465730000",
    // Buttons of Button0, both up.
    "000000246b01b2fc000df82c00000003000000130000001d00000002000000000000000074726f6c",
    // Pose of sensor 0 of Tracker0.
    "000000586b01b2fd0000118c000000010000000400000024000000000000000000000000000000000000000000000000\
     000000000000000000000000000000003fd7784619fa0f4e00000000000000003fedc549a32c6b58",
    // Its velocity.
    "000000606b01b2fd0000118c000000010000000500000025000000000000000000000000000000000000000000000000\
     000000000000000000000000000000003fef9b24942fe45c00000000000000003fc4060b67a853774011fffffb800001",
    // Button 0 of Button0 goes down.
    "000000206b01b2fd00003d060000000300000012000000360000000000000001",
];

pub fn bytes(hexadecimal: &str) -> Vec<u8> {
    (0..hexadecimal.len())
        .step_by(2)
        .map(|at| u8::from_str_radix(&hexadecimal[at..at + 2], 16).expect("two digits"))
        .collect()
}

fn events(device: &str) -> Vec<Event> {
    let mut client = Client::new(device, None);
    for message in SENT {
        client
            .receive(&bytes(message))
            .expect("a real server's bytes");
    }
    std::iter::from_fn(|| client.next_event()).collect()
}

#[test]
fn a_real_server_s_tracker_is_understood() {
    let events = events("Tracker0");
    assert_eq!(
        events[..2],
        [
            Event::Open(Version {
                major: 7,
                minor: 38
            }),
            Event::Found
        ]
    );
    let [Event::Pose(pose, time), Event::Velocity(velocity, _)] = &events[2..] else {
        panic!("{events:?}");
    };
    assert_eq!((pose.sensor, pose.position), (0, [0.0; 3]));
    assert!(time.microseconds < 1_000_000);
    // It spins about the axis (0, 1, 0) that its configuration named.
    let turn = SensorMapping::identity()
        .pose(pose)
        .expect("a unit quaternion")
        .rotation;
    let axis = turn.axis().expect("it has turned").into_inner();
    assert!(axis.x.abs() < 1e-12 && axis.z.abs() < 1e-12, "{axis}");
    assert!(turn.angle() > 0.5);
    assert_eq!(velocity.linear, [0.0; 3]);
    assert!(velocity.interval > 0.0);
    // Encoding gives the payloads back.
    let sent = |at: usize| bytes(SENT[at])[24..].to_vec();
    let places = [pose.encode(), velocity.encode()]
        .map(|payload| (0..SENT.len()).filter(|at| sent(*at) == payload).count());
    assert_eq!(places, [1, 1]);
}

#[test]
fn a_real_server_s_buttons_are_understood() {
    let events = events("Button0");
    assert_eq!(events[2], Event::Buttons(ButtonStates(vec![false, false])));
    let Event::Button(change) = &events[3] else {
        panic!("{events:?}");
    };
    assert_eq!((change.button, change.pressed), (0, true));
    assert_eq!(events.len(), 4);
}
