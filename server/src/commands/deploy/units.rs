//! systemd units of a machine: those of `docs/systemd`, with this workbench's arguments in place of environment files.

use std::net::SocketAddr;

use taut_bridge::{DeviceChoice, InputChoice};
use taut_kinds::read_choice;
use taut_scene::{Device, Machine, TransportKind, Workbench};

use crate::commands::arguments::HeadFrom;
use crate::commands::keys::file_name;
use crate::shared::failure::Failure;

const SERVE: &str = include_str!("../../../../docs/systemd/taut-serve.service");
const BRIDGE: &str = include_str!("../../../../docs/systemd/taut-bridge.service");
const TRACK: &str = include_str!("../../../../docs/systemd/taut-track.service");
const RENDER: &str = include_str!("../../../../docs/systemd/taut-render@.service");

/// Where devices of each way of connection are.
const ON_HID: &[&str] = &[
    "DeviceAllow=char-hidraw rw",
    "DeviceAllow=char-usb_device rw",
];

/// Instead of the unit's own: opened again by itself, the device would take the place where it is held then for its home.
const STARTED_BY_A_PERSON: &str = "Restart=no";

pub(super) struct Unit {
    /// With its ending.
    pub(super) name: String,
    /// Of the session of the account that draws, else of the system.
    pub(super) is_session: bool,
    pub(super) text: String,
}

/// The units of a machine: one per role, one per node.
pub(super) fn units(
    workbench: &Workbench,
    machine: &Machine,
    server: SocketAddr,
    follow_scene: bool,
) -> Result<Vec<Unit>, Failure> {
    let mut units = Vec::new();
    let client = Client {
        server,
        transport: workbench.network.transport,
    };
    if machine.server {
        units.push(server_unit(&workbench.device, machine, follow_scene)?);
    }
    if let Some(device) = &machine.device {
        let command = client.command("bridge", "device", &["--device", device])?;
        let more = reached_by(device, machine)?;
        units.push(system(
            "taut-bridge.service",
            filled(BRIDGE, machine, &command, &more),
        ));
    }
    if let Some(source) = &machine.tracker {
        let command = client.command("track", "tracker", &["--source", source])?;
        check_source(source, machine)?;
        units.push(system(
            "taut-track.service",
            filled(TRACK, machine, &command, &[]),
        ));
    }
    for node in &machine.nodes {
        let key = format!("render-{}", file_name(node));
        let command = client.command("render", &key, &["--node", node])?;
        units.push(Unit {
            name: format!("taut-{key}.service"),
            is_session: true,
            // Before the command is in it: a node may have `%i` in its name.
            text: filled(
                &RENDER.replace("%i", &file_name(node)),
                machine,
                &command,
                &[],
            ),
        });
    }
    Ok(units)
}

fn server_unit(device: &Device, machine: &Machine, follow_scene: bool) -> Result<Unit, Failure> {
    let mut command =
        "taut serve --config /etc/taut/workbench.toml --key /etc/taut/cluster.key".to_owned();
    if follow_scene {
        command.push_str(" --follow-scene");
    }
    let mut more = match device {
        Device::Driver(chosen) => {
            let reached = DeviceChoice::of(chosen)
                .map_err(|error| error.to_string())
                .and_then(|choice| choice.as_ref().map_or(Ok(Vec::new()), allowed));
            reached.map_err(|why| {
                Failure::BadInput(format!("[device] of kind \"{}\": {why}", chosen.kind.name))
            })?
        }
        _ => Vec::new(),
    };
    more.push("Environment=TAUT_DATA=/etc/taut/data".to_owned());
    Ok(system(
        "taut-serve.service",
        filled(SERVE, machine, &command, &more),
    ))
}

fn system(name: &str, text: String) -> Unit {
    Unit {
        name: name.to_owned(),
        is_session: false,
        text,
    }
}

/// How clients of this workbench find their server.
struct Client {
    server: SocketAddr,
    transport: TransportKind,
}

impl Client {
    fn command(&self, role: &str, key: &str, more: &[&str]) -> Result<String, Failure> {
        let mut command = format!(
            "taut {role} --server {} --key /etc/taut/{key}.key",
            self.server
        );
        for word in more {
            command.push(' ');
            let word = quoted(word);
            command.push_str(&word.map_err(|why| {
                Failure::BadInput(format!("the service of `taut {role}`: {why}"))
            })?);
        }
        if self.transport == TransportKind::QuicDatagram {
            command.push_str(" --transport quic");
        }
        Ok(command + " --stay")
    }
}

/// A word of a command line in a unit: systemd expands `%` and `$`, and splits at blanks. A line break would begin a setting of its own.
fn quoted(word: &str) -> Result<String, String> {
    if word.contains(char::is_control) {
        return Err(format!(
            "{word:?} has a control character, such as a line break, which a unit of systemd cannot hold; take it out"
        ));
    }
    let is_plain = |c: char| c.is_alphanumeric() || "-_.,:;/@=+".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) && !word.starts_with(';') {
        return Ok(word.to_owned());
    }
    let mut text = String::from("\"");
    for c in word.chars() {
        match c {
            '"' | '\\' => text.extend(['\\', c]),
            '%' | '$' => text.extend([c, c]),
            _ => text.push(c),
        }
    }
    text.push('"');
    Ok(text)
}

/// The unit of `docs/systemd` with its own command; how to install it by hand is left out.
fn filled(unit: &str, machine: &Machine, command: &str, more: &[String]) -> String {
    let mut text = format!("# Made for {} by `taut deploy`.\n", machine.name);
    let by_hand = more.iter().any(|line| line == STARTED_BY_A_PERSON);
    let is_left_out = |line: &&str| {
        line.starts_with("EnvironmentFile=") || (by_hand && line.starts_with("Restart"))
    };
    let lines = unit.lines().skip_while(|line| line.starts_with('#'));
    for line in lines.filter(|line| !is_left_out(line)) {
        if line.starts_with("ExecStart=") {
            text.push_str(&format!("ExecStart={command}\n"));
            for line in more {
                text.push_str(line);
                text.push('\n');
            }
        } else {
            text.push_str(line);
            text.push('\n');
        }
    }
    text
}

fn reached_by(device: &str, machine: &Machine) -> Result<Vec<String>, Failure> {
    reached_by_a_service(device).map_err(|why| {
        Failure::BadInput(format!(
            "the device of {} is \"{device}\": {why}",
            machine.name
        ))
    })
}

/// What the unit of the bridge must be allowed, so that it reaches this device; or why a service cannot have it.
pub(in crate::commands) fn reached_by_a_service(device: &str) -> Result<Vec<String>, String> {
    let chosen = read_choice(device).map_err(|error| error.to_string())?;
    let choice = DeviceChoice::of(&chosen).map_err(|error| error.to_string())?;
    let lines = choice.as_ref().map_or(Ok(Vec::new()), allowed)?;
    match chosen.files().find(|file| !file.is_absolute()) {
        Some(file) => Err(format!(
            "a service finds a file by its whole path; begin {} with /",
            file.display()
        )),
        None => Ok(lines),
    }
}

/// What the unit must be allowed for this device, and whether it may start it again.
fn allowed(choice: &DeviceChoice) -> Result<Vec<String>, String> {
    let mut lines = reached(choice)?;
    if choice.is_calibrated_when_opened() {
        lines.push(STARTED_BY_A_PERSON.to_owned());
    }
    Ok(lines)
}

fn reached(choice: &DeviceChoice) -> Result<Vec<String>, String> {
    let on_serial = |port: &str| -> Result<Vec<String>, String> {
        Ok(vec![
            format!("DeviceAllow={} rw", quoted(port)?),
            "SupplementaryGroups=dialout".to_owned(),
        ])
    };
    let lines: &[&str] = match choice {
        DeviceChoice::Mouse => {
            return Err("that is a render window's; run `taut render --hold` there by hand".into());
        }
        DeviceChoice::Input(InputChoice::Spidar(settings)) => {
            return on_serial(&settings.path);
        }
        DeviceChoice::Input(InputChoice::Polhem(settings)) => {
            return on_serial(&settings.path);
        }
        DeviceChoice::Input(InputChoice::SpaceMouse(_)) => ON_HID,
        #[cfg(unix)]
        DeviceChoice::Input(InputChoice::Wooden(_)) => ON_HID,
        DeviceChoice::Input(InputChoice::Plugin(_)) => {
            return Err("what a plug-in opens is not known; run `taut bridge` there by hand (with kind = \"remote\" in the workbench file), or write a unit that allows its device".into());
        }
        DeviceChoice::Input(InputChoice::Vrpn(_) | InputChoice::Haply(_))
        | DeviceChoice::Simulated { .. }
        | DeviceChoice::Trace(_) => &[],
    };
    Ok(lines.iter().map(ToString::to_string).collect())
}

fn check_source(source: &str, machine: &Machine) -> Result<(), Failure> {
    let refuse = |why: String| Failure::BadInput(format!("the tracker of {}: {why}", machine.name));
    match source.parse::<HeadFrom>() {
        Ok(HeadFrom::Trace(path)) if !path.is_absolute() => Err(refuse(format!(
            "a service finds {} by its whole path only; begin it with /",
            path.display()
        ))),
        Ok(_) => Ok(()),
        Err(error) => Err(refuse(error.to_string())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_that_systemd_would_change_are_quoted() {
        for (word, text) in [
            ("front", "front"),
            ("vrpn:Head@lab,axes=x -z y", "\"vrpn:Head@lab,axes=x -z y\""),
            ("100%", "\"100%%\""),
            ("a\"$b", "\"a\\\"$$b\""),
        ] {
            assert_eq!(quoted(word).as_deref(), Ok(text));
        }
    }

    #[test]
    fn words_that_would_begin_a_line_of_their_own_are_refused() {
        for word in ["front\nExecStartPre=/bin/true", "front\r", "a\0b", "\u{85}"] {
            let why = quoted(word).expect_err(word);
            assert!(why.starts_with(&format!("{word:?} has")), "{why}");
        }
        let reached = reached_by_a_service("spidar:/dev/tty\nUser=root");
        let why = reached.expect_err("two lines");
        assert!(why.contains("control character"), "{why}");
    }

    #[test]
    fn a_device_that_is_calibrated_when_opened_is_not_opened_again_by_itself() {
        let machine = Machine {
            name: "a".to_owned(),
            address: std::net::Ipv4Addr::LOCALHOST.into(),
            server: false,
            nodes: Vec::new(),
            device: None,
            tracker: None,
        };
        for (device, is_calibrated) in [
            ("spidar:/dev/ttyUSB0", true),
            ("wooden", true),
            ("polhem:/dev/ttyUSB0", false),
            ("simulated", false),
        ] {
            let more = reached_by_a_service(device).expect(device);
            for unit in [BRIDGE, SERVE] {
                let text = filled(unit, &machine, "taut", &more);
                let is_started_again = text.contains("Restart=on-failure");
                assert_eq!(is_started_again, !is_calibrated, "{device}");
                assert_eq!(text.contains("Restart=no"), is_calibrated, "{device}");
            }
        }
    }

    #[test]
    fn a_device_s_files_are_named_by_their_whole_paths() {
        for (device, is_whole) in [
            ("trace:hand.csv", false),
            ("trace:/srv/hand.csv", true),
            ("simulated,strings=my.toml", false),
            ("simulated,strings=/srv/my.toml", true),
            ("simulated,strings=wb", true),
            ("spidar:ttyUSB0", false),
            ("spidar:/dev/ttyUSB0", true),
        ] {
            let reached = reached_by_a_service(device);
            assert_eq!(reached.is_ok(), is_whole, "{device}: {reached:?}");
            let why = reached.err().unwrap_or_default();
            assert!(is_whole || why.contains("whole path"), "{device}: {why}");
        }
    }
}
