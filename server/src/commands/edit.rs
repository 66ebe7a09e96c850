//! `taut edit`: changes the scene of a session that runs, at its operator's page, or says what of it can be changed.

use std::fmt::Write as _;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream, ToSocketAddrs};
use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use serde_json::{Value, json};
use taut_link::proto::text::Printable;
use taut_scene::{Operator, shell_word};

use crate::shared::failure::Failure;

/// Longest that the page may take to be reached.
const REACHING: Duration = Duration::from_secs(2);
/// Longest that the page may take to answer: a changed scene is read and checked.
const ANSWERING: Duration = Duration::from_secs(130);
/// Most bytes of an answer.
const MAX_ANSWER_BYTES: u64 = 1 << 22;

/// `taut edit`.
#[derive(Clone, Debug, Args)]
#[command(
    after_help = "Example: taut edit --token-file operator.token plate.surface.friction=0.3 'plate.pose.position=[0, 0, -0.01]' coupling.k_h=1500"
)]
pub struct EditArgs {
    /// What becomes of a key of the scene, such as plate.color=#30c030; none: says what can be changed
    #[arg(value_name = "NAME.KEY=VALUE")]
    pub edits: Vec<String>,
    /// The operator's page of the session, on this machine or at this end of an SSH tunnel
    #[arg(long, value_name = "H:P", default_value = "127.0.0.1:4861")]
    pub page: String,
    /// The token of the page: token_file of the section operator
    #[arg(long, value_name = "FILE")]
    pub token_file: Option<PathBuf>,
    /// Another scene, one of the scenes of the section operator; the edits are then of that
    #[arg(long, value_name = "NAME")]
    pub scene: Option<String>,
    /// Put it into the scene's file, too; without edits: what was changed before
    #[arg(long)]
    pub keep: bool,
    /// Only if this revision of the scene runs still
    #[arg(long, value_name = "N")]
    pub revision: Option<u64>,
}

/// Changes the scene, or shows it; what to print.
pub(super) fn run(args: &EditArgs) -> Result<String, Failure> {
    let page = addresses(&args.page)?;
    if args.edits.is_empty() && args.scene.is_none() && !args.keep {
        let text = ask(&page, "GET /scene", "", "")?;
        return overview(&text).ok_or_else(|| {
            Failure::failed(format!(
                "{} is no operator's page of this version",
                args.page
            ))
        });
    }
    let Some(file) = &args.token_file else {
        return Err(Failure::bad_input(
            "changing a scene needs the token of the operator's page; name its file with --token-file",
        ));
    };
    let of_page = Operator {
        token_file: Some(file.clone()),
        ..Operator::default()
    };
    let token = of_page.token().map_err(Failure::bad_input)?;
    let token = token.unwrap_or_default();
    let wish = json!({
        "revision": args.revision,
        "scene": args.scene,
        "edits": args.edits,
        "keep": args.keep,
    });
    let shown = format!("Authorization: Bearer {token}\r\n");
    ask(&page, "POST /edit", &shown, &wish.to_string())
}

/// Those of this machine, one at least: the token goes over no network in the clear.
fn addresses(named: &str) -> Result<Vec<SocketAddr>, Failure> {
    let found = named.to_socket_addrs().map_err(|error| {
        Failure::BadInput(format!(
            "--page {named} is no address ({error}); write 127.0.0.1:4861"
        ))
    })?;
    let here: Vec<SocketAddr> = found.filter(|address| address.ip().is_loopback()).collect();
    if here.is_empty() {
        return Err(Failure::BadInput(format!(
            "--page {named} is not on this machine, and the token goes over no network; use ssh -L 4861:127.0.0.1:4861 HOST"
        )));
    }
    Ok(here)
}

/// A connection to the first of these that takes one, and which that is. A page listens on one of the addresses that `localhost` may be.
fn reach(page: &[SocketAddr]) -> Result<(TcpStream, SocketAddr), Failure> {
    let mut why = String::new();
    for &address in page {
        match TcpStream::connect_timeout(&address, REACHING) {
            Ok(stream) => return Ok((stream, address)),
            Err(error) => why = lost(address, &error),
        }
    }
    Err(Failure::Failed(why))
}

fn lost(page: SocketAddr, error: &std::io::Error) -> String {
    format!(
        "the operator's page at {page} was not reached ({error}); check that [operator] is enabled, and its port"
    )
}

/// The body of the page's answer.
fn ask(page: &[SocketAddr], line: &str, shown: &str, body: &str) -> Result<String, Failure> {
    let (mut stream, page) = reach(page)?;
    let lost = |error: std::io::Error| Failure::Failed(lost(page, &error));
    stream.set_read_timeout(Some(ANSWERING)).map_err(lost)?;
    let length = body.len();
    let request =
        format!("{line} HTTP/1.1\r\nHost: {page}\r\n{shown}Content-Length: {length}\r\n\r\n{body}");
    stream.write_all(request.as_bytes()).map_err(lost)?;
    let mut bytes = Vec::new();
    let reading = stream.take(MAX_ANSWER_BYTES).read_to_end(&mut bytes);
    reading.map_err(lost)?;
    let answer = String::from_utf8_lossy(&bytes);
    let (head, body) = answer.split_once("\r\n\r\n").unwrap_or((&answer, ""));
    let body = body.trim();
    match head.split(' ').nth(1) {
        Some("200") => Ok(body.to_owned()),
        Some(_) if !body.is_empty() => Err(Failure::BadInput(Printable(body).to_string())),
        _ => Err(Failure::failed(format!("{page} is no operator's page"))),
    }
}

/// What can be changed, for people.
fn overview(text: &str) -> Option<String> {
    let page: Value = serde_json::from_str(text).ok()?;
    let (standing, scene) = (page.get("standing")?, page.get("scene")?);
    let mut lines = format!(
        "scene {}, from {}, revision {}\n",
        standing.get("name")?,
        standing.get("from")?,
        standing.get("revision")?
    );
    let coupling = scene.get("coupling")?.as_object()?;
    for (key, value) in coupling.iter().filter(|(key, _)| *key != "stiffness") {
        let _ = writeln!(lines, "coupling.{key}={value}");
    }
    let stiffness = coupling.get("stiffness")?;
    let _ = writeln!(lines, "  stiffness: {stiffness} N/m");
    for object in scene.get("objects")?.as_array()? {
        let name = object.get("name")?.as_str()?;
        let keys = [
            ("position", "pose.position"),
            ("rotation", "pose.rotation"),
            ("color", "color"),
            ("opacity", "opacity"),
            ("friction", "surface.friction"),
            ("roughness", "roughness"),
            ("metallic", "metallic"),
        ];
        let is_fixed = |key: &str| key.starts_with("pose") && object["moves"] == true;
        for (shown, key) in keys {
            let value = object.get(shown)?;
            let name = shell_word(&Printable(name).to_string());
            if !value.is_null() && !is_fixed(key) {
                let _ = writeln!(lines, "{name}.{key}={value}");
            } else if matches!(key, "roughness" | "metallic") {
                let _ = writeln!(lines, "  {name}.{key}: as usual");
            }
        }
    }
    let more = scene.get("more")?.as_u64()?;
    if more > 0 {
        let _ = writeln!(lines, "and {more} more objects, not shown");
    }
    for change in standing.get("not_kept")?.as_array()? {
        let _ = writeln!(lines, "not in the file: {}", Printable(change.as_str()?));
    }
    Some(lines.trim_end().to_owned())
}

#[cfg(test)]
mod tests {
    use std::net::{Ipv4Addr, Ipv6Addr, TcpListener};

    use super::*;

    #[test]
    fn the_token_stays_on_this_machine() {
        assert!(addresses("127.0.0.1:4861").is_ok());
        assert!(addresses("localhost:4861").is_ok());
        for bad in ["192.0.2.1:4861", "127.0.0.1", "0.0.0.0:4861", ""] {
            assert!(addresses(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn each_address_of_this_machine_is_tried() {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).expect("a port");
        let page = listener.local_addr().expect("an address");
        let nobody = SocketAddr::from((Ipv6Addr::LOCALHOST, page.port()));
        let (_, reached) = reach(&[nobody, page]).expect("the page");
        assert_eq!(reached, page);
        let refused = reach(&[nobody]).expect_err("nobody is there");
        assert!(refused.to_string().contains(&nobody.to_string()));
    }

    #[test]
    fn an_overview_is_what_could_be_typed() {
        let page = json!({
            "standing": { "revision": 2, "name": "a", "from": "a.toml", "not_kept": ["b.color: 1 -> 2"] },
            "scene": {
                "coupling": { "k_h": 2000.0, "stiffness": 1000.0 },
                "objects": [{ "name": "b\u{1b}", "position": [0, 0, 1], "rotation": [1, 0, 0, 0], "color": "#ffffff",
                              "opacity": 1.0, "friction": null, "roughness": 0.25, "metallic": null, "moves": true }, { "name": "a b", "position": [0, 0, 1], "rotation": null,
                              "color": null, "opacity": null, "friction": 0.5, "roughness": null, "metallic": 1.0, "moves": false }],
                "more": 3
            }
        });
        let text = overview(&page.to_string()).expect("understood");
        assert!(text.contains("coupling.k_h=2000.0") && text.contains("3 more objects"));
        assert!(text.contains("color=\"#ffffff\"") && text.contains("not in the file: b.color"));
        assert!(!text.contains("rotation") && !text.contains('\u{1b}'));
        assert!(text.contains("'a b'.pose.position=[0,0,1]\n'a b'.surface.friction=0.5\n"));
        assert_eq!(text.matches("friction").count(), 1);
        assert!(text.contains(".roughness=0.25\n") && text.contains(".metallic: as usual\n"));
        assert!(text.contains("  'a b'.roughness: as usual\n'a b'.metallic=1.0\n"));
        assert_eq!(overview("{}"), None);
    }
}
