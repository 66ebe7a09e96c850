//! The JSON lines that observers read: one object per line, its kind in `type`.
//!
//! | `type`   | when                                                    | built by            |
//! |----------|---------------------------------------------------------|---------------------|
//! | `hello`  | first, once                                             | [`Hello`]           |
//! | `state`  | at the stream's rate, newest wins                       | [`state_line`]      |
//! | `event`  | once per discrete event                                 | [`EventLines`](crate::EventLines) |
//! | `missed` | where an observer was too slow for its events           | [`missed_line`]     |
//!
//! SI units; quaternions w x y z; session time in s. `docs/interoperability.md` describes every field. A field may be added
//! without a new [`FORMAT`]; a field that goes or changes its meaning raises it.

use serde::Serialize;
use taut_proto::state::{
    BodyState, ContactState, HEAD_TRACKED, HeadState, RunState, TOOL_DEVICE_SILENT,
    TOOL_FORCE_LIMITED, ToolState,
};
use taut_proto::{HotState, PoseF32, PoseF64, SceneDescription};

/// Number of this form of the lines.
pub const FORMAT: u32 = 1;

/// How the device port's events are called; see [`EventLines`](crate::EventLines).
pub type Naming = fn(u8) -> Option<&'static str>;

/// What an observer is told first.
#[derive(Clone, Debug, PartialEq)]
pub struct Hello {
    /// Name of the workbench.
    pub workbench: String,
    /// Program and version.
    pub program: String,
    /// The scene.
    pub scene: SceneDescription,
    /// States per second at most.
    pub rate: f64,
}

#[derive(Serialize)]
struct HelloLine<'a> {
    r#type: &'static str,
    format: u32,
    program: &'a str,
    workbench: &'a str,
    scene: &'a str,
    scene_revision: u32,
    rate_hz: f64,
    units: Units,
    frames: Frames,
    quaternion: &'static str,
    workbench_from_scene: Placed,
    display_scale: f64,
    reference_point: [f64; 3],
    god_object: &'a str,
    obstacles: Vec<Obstacle<'a>>,
    screens: Vec<Screen<'a>>,
    viewer: Placed,
    eye_separation: f64,
}

#[derive(Serialize)]
struct Units {
    length: &'static str,
    time: &'static str,
    angle: &'static str,
    force: &'static str,
    torque: &'static str,
}

#[derive(Serialize)]
struct Frames {
    scene: &'static str,
    workbench: &'static str,
}

/// Position, m, and rotation, w x y z.
#[derive(Serialize)]
struct Placed {
    p: [f64; 3],
    q: [f64; 4],
}

#[derive(Serialize)]
struct Obstacle<'a> {
    name: &'a str,
    #[serde(flatten)]
    pose: Placed,
}

#[derive(Serialize)]
struct Screen<'a> {
    name: &'a str,
    lower_left: [f64; 3],
    lower_right: [f64; 3],
    upper_left: [f64; 3],
}

#[derive(Serialize)]
struct StateLine<'a> {
    r#type: &'static str,
    t: f64,
    tick: u64,
    scene_revision: u32,
    run: &'static str,
    constraint_age: f64,
    tools: Vec<Tool<'a>>,
    head: Head,
    bodies: Vec<Body>,
    contacts: Vec<Contact<'a>>,
}

/// Position, m, and rotation, w x y z, as the wire has them: in single precision.
#[derive(Serialize)]
struct Single {
    p: [f32; 3],
    q: [f32; 4],
}

#[derive(Serialize)]
struct Tool<'a> {
    id: u32,
    god_object: Single,
    device: Single,
    linear_velocity: &'a [f32; 3],
    angular_velocity: &'a [f32; 3],
    force: &'a [f32; 3],
    torque: &'a [f32; 3],
    buttons: Vec<u32>,
    force_limited: bool,
    device_silent: bool,
}

#[derive(Serialize)]
struct Head {
    #[serde(flatten)]
    pose: Single,
    age: f64,
    eye_separation: f32,
    tracked: bool,
}

#[derive(Serialize)]
struct Body {
    obstacle: u16,
    #[serde(flatten)]
    pose: Single,
}

#[derive(Serialize)]
struct Contact<'a> {
    tool: u16,
    obstacle: u16,
    point: &'a [f32; 3],
    normal: &'a [f32; 3],
    gap: f32,
}

#[derive(Serialize)]
struct MissedLine {
    r#type: &'static str,
    events: u64,
}

impl Hello {
    /// The line, without its end.
    #[must_use]
    pub fn line(&self) -> String {
        let scene = &self.scene;
        let obstacles = scene.obstacles.iter().map(|body| Obstacle {
            name: body.name.raw(),
            pose: placed(&body.pose),
        });
        let screens = scene.screens.iter().map(|screen| Screen {
            name: screen.name.raw(),
            lower_left: screen.lower_left,
            lower_right: screen.lower_right,
            upper_left: screen.upper_left,
        });
        written(&HelloLine {
            r#type: "hello",
            format: FORMAT,
            program: &self.program,
            workbench: &self.workbench,
            scene: scene.name.raw(),
            scene_revision: scene.revision,
            rate_hz: self.rate,
            units: Units {
                length: "m",
                time: "s",
                angle: "rad",
                force: "N",
                torque: "N m",
            },
            frames: Frames {
                scene: "tools, bodies, contacts, obstacles",
                workbench: "head, screens, viewer",
            },
            quaternion: "w x y z",
            workbench_from_scene: placed(&scene.scene_origin),
            display_scale: scene.display_scale,
            reference_point: scene.reference_point,
            god_object: scene.god_object.name.raw(),
            obstacles: obstacles.collect(),
            screens: screens.collect(),
            viewer: placed(&scene.viewer),
            eye_separation: scene.eye_separation,
        })
    }
}

/// A state, without the line's end.
#[must_use]
pub fn state_line(state: &HotState) -> String {
    written(&StateLine {
        r#type: "state",
        t: state.sample_time_ns as f64 / 1e9,
        tick: state.tick,
        scene_revision: state.scene_revision,
        run: run_name(state.run),
        constraint_age: f64::from(state.constraint_age_us) / 1e6,
        tools: state.tools.iter().map(tool).collect(),
        head: head(&state.head),
        bodies: state.bodies.iter().map(body).collect(),
        contacts: state.contacts.iter().map(contact).collect(),
    })
}

/// What the device does, as the lines call it.
#[must_use]
pub fn run_name(run: RunState) -> &'static str {
    match run {
        RunState::Waiting => "waiting",
        RunState::Running => "running",
        RunState::Paused => "paused",
        RunState::Fault => "fault",
    }
}

/// How many events an observer missed because it was too slow, without the line's end.
#[must_use]
pub fn missed_line(events: u64) -> String {
    written(&MissedLine {
        r#type: "missed",
        events,
    })
}

fn tool(tool: &ToolState) -> Tool<'_> {
    let buttons = (0..u16::BITS).filter(|button| tool.buttons >> button & 1 == 1);
    Tool {
        id: tool.id,
        god_object: single(&tool.god_object),
        device: single(&tool.device),
        linear_velocity: &tool.linear_velocity,
        angular_velocity: &tool.angular_velocity,
        force: &tool.force,
        torque: &tool.torque,
        buttons: buttons.collect(),
        force_limited: tool.flags & TOOL_FORCE_LIMITED != 0,
        device_silent: tool.flags & TOOL_DEVICE_SILENT != 0,
    }
}

fn head(head: &HeadState) -> Head {
    Head {
        pose: single(&head.pose),
        // Of a head that stays where it is, its report is from now, and a little later than the state.
        age: (f64::from(head.age_us) / 1e6).max(0.0),
        eye_separation: head.eye_separation,
        tracked: head.flags & HEAD_TRACKED != 0,
    }
}

fn body(body: &BodyState) -> Body {
    Body {
        obstacle: body.id,
        pose: single(&body.pose),
    }
}

fn contact(contact: &ContactState) -> Contact<'_> {
    Contact {
        tool: contact.pair[0],
        obstacle: contact.pair[1],
        point: &contact.point,
        normal: &contact.normal,
        gap: contact.gap,
    }
}

fn placed(pose: &PoseF64) -> Placed {
    Placed {
        p: pose.position,
        q: pose.rotation,
    }
}

fn single(pose: &PoseF32) -> Single {
    Single {
        p: pose.position,
        q: pose.rotation,
    }
}

/// The object as text on one line: JSON escapes line ends within strings.
pub(crate) fn written(line: &impl Serialize) -> String {
    // Numbers, texts and lists always have a form.
    serde_json::to_string(line).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, json};

    #[test]
    fn a_state_says_everything_in_its_documented_place() {
        let mut state = HotState::empty();
        state.sample_time_ns = 1_500_000_000;
        state.tick = 1500;
        state.run = RunState::Running;
        state.constraint_age_us = 250;
        state.tools.push(ToolState {
            force: [0.1, 0.0, -2.5],
            buttons: 0b101,
            flags: TOOL_FORCE_LIMITED,
            ..ToolState::default()
        });
        state.head.flags = HEAD_TRACKED;
        state.head.age_us = -1_500;
        state.bodies.push(BodyState {
            id: 3,
            flags: 0,
            pose: PoseF32::IDENTITY,
        });
        state.contacts.push(ContactState {
            pair: [0, 3],
            point: [0.0, 0.0, 0.5],
            normal: [0.0, 0.0, 1.0],
            force: 0.0,
            gap: 1e-4,
        });
        let text = state_line(&state);
        // Single precision is told in the fewest digits that give it back.
        assert!(text.contains("\"force\":[0.1,0.0,-2.5]"), "{text}");
        let line: Value = serde_json::from_str(&text).expect("JSON");
        assert_eq!(
            (&line["type"], &line["run"], &line["t"], &line["tick"]),
            (
                &json!("state"),
                &json!("running"),
                &json!(1.5),
                &json!(1500)
            )
        );
        let tool = &line["tools"][0];
        assert_eq!(tool["buttons"], json!([0, 2]));
        assert_eq!(tool["god_object"]["q"], json!([1.0, 0.0, 0.0, 0.0]));
        assert_eq!(
            (&tool["force_limited"], &tool["device_silent"]),
            (&json!(true), &json!(false))
        );
        let head = &line["head"];
        assert_eq!(
            (&head["tracked"], &head["age"]),
            (&json!(true), &json!(0.0))
        );
        assert_eq!(line["bodies"][0]["obstacle"], json!(3));
        assert_eq!(line["contacts"][0]["normal"], json!([0.0, 0.0, 1.0]));
    }

    fn empty_scene() -> SceneDescription {
        let body = taut_proto::scene::BodyDescription {
            name: "ball".into(),
            mesh: taut_proto::MeshHash::of(b""),
            pose: PoseF64::IDENTITY,
            colour: [1.0; 4],
        };
        SceneDescription {
            obstacles: vec![body.clone()],
            ..SceneDescription::of_body("", body)
        }
    }

    #[test]
    fn a_name_cannot_break_the_line() {
        let mut scene = empty_scene();
        scene.name = "two\nlines \"quoted\"".into();
        let hello = Hello {
            workbench: "bench".to_owned(),
            program: "taut".to_owned(),
            scene,
            rate: 60.0,
        };
        let text = hello.line();
        assert!(!text.contains('\n'));
        let line: Value = serde_json::from_str(&text).expect("JSON");
        assert_eq!(line["scene"], json!("two\nlines \"quoted\""));
        assert_eq!(line["format"], json!(FORMAT));
    }
}
