//! `taut setup`: asks what a workbench is made of and writes its file, which `taut check` accepts and `taut deploy` takes.

mod file;
mod found;
mod questions;

use std::io::{BufRead, Write};
use std::net::IpAddr;
use std::path::Path;

use taut_kinds::{KINDS, Kind, KindId};
use taut_scene::{Stereo, Workbench};

use file::{Answers, Pc, Place, Wall};
use found::Found;
use questions::Questions;

use super::deploy::reached_by_a_service;
use crate::cli::SetupArgs;
use crate::shared::failure::Failure;

/// Most screens that are asked for: one of each place.
const MAX_SCREENS: usize = Place::ALL.len();
/// Sides of a screen that are asked for, m.
const SIDE: (f64, f64) = (0.1, 20.0);

/// Asks, writes, and says what comes next.
pub(super) fn run(
    args: &SetupArgs,
    input: impl BufRead,
    output: impl Write,
) -> Result<String, Failure> {
    let out = &args.out;
    if out.exists() {
        return Err(in_the_way(out));
    }
    let folder = out.parent().unwrap_or(Path::new(""));
    // Before a question is asked.
    if folder != Path::new("") && !folder.is_dir() {
        return Err(Failure::BadInput(format!(
            "{} is no folder, so {} cannot be written; make it, or give another --out",
            folder.display(),
            out.display()
        )));
    }
    let found = Found::here();
    let mut questions = Questions::new(input, output, args.yes);
    questions.tell(&found.to_string())?;
    let answers = ask(&mut questions, &found)?;
    let text = answers.text();
    // What is written is good, or is not written.
    Workbench::parse(&out.display().to_string(), &text, folder)?;
    let mut file = std::fs::File::create_new(out).map_err(|error| match error.kind() {
        std::io::ErrorKind::AlreadyExists => in_the_way(out),
        _ => Failure::BadInput(format!("{}: {error}; choose another --out", out.display())),
    })?;
    if let Err(error) = file
        .write_all(text.as_bytes())
        .and_then(|()| file.sync_all())
    {
        // Half a workbench is none; it was made here, just now.
        let _ = std::fs::remove_file(out);
        return Err(Failure::Failed(format!(
            "{}: {error}; check the free space",
            out.display()
        )));
    }
    Ok(format!(
        "{0} is written; measure the corners of your screens and mend them there, then: taut check {0} && taut keys --out cluster.key && taut deploy {0} --master cluster.key --out deploy",
        taut_scene::shell_word(&out.display().to_string())
    ))
}

fn in_the_way(out: &Path) -> Failure {
    Failure::BadInput(format!(
        "{} is there already and is not written over; give another --out, or change it by hand",
        out.display()
    ))
}

fn ask(
    questions: &mut Questions<impl BufRead, impl Write>,
    found: &Found,
) -> Result<Answers, Failure> {
    let name = questions.text(
        "name of the workbench",
        "for people, and for the log",
        "my workbench",
        |_| Ok(()),
    )?;
    let screens = questions.count(
        "number of screens",
        "flat ones: front wall, table, left wall, right wall, in this order",
        2,
        MAX_SCREENS,
    )?;
    let server = Pc {
        name: questions.text(
            "name of the haptic PC",
            "runs the simulation and the device",
            &found.host,
            plain,
        )?,
        address: address(questions, "address of the haptic PC", found.address, &[])?,
    };
    let mut pcs: Vec<Pc> = vec![server];
    let places = Place::ALL.into_iter().take(screens);
    let walls = places
        .map(|place| wall(questions, place, &mut pcs, found.address))
        .collect::<Result<_, _>>()?;
    let stereo = stereo(questions)?;
    let device = questions.text(
        "the haptic device",
        &format!(
            "{}; `taut bridge --help` has their options; a simulated one needs nothing and pushes nobody",
            device_names()
        ),
        found.device.as_deref().unwrap_or("simulated"),
        |text| reached_by_a_service(text).map(|_| ()),
    )?;
    Ok(Answers {
        name,
        walls,
        stereo,
        device,
        pcs,
        window: found.window(),
    })
}

/// A screen, whose PC comes to `pcs` if it is a new one.
fn wall(
    questions: &mut Questions<impl BufRead, impl Write>,
    place: Place,
    pcs: &mut Vec<Pc>,
    this_pc: IpAddr,
) -> Result<Wall, Failure> {
    let screen = place.name();
    let (width, height) = place.size();
    let width = questions.number(
        &format!("width of {screen}"),
        "m, the picture alone, without its frame",
        width,
        SIDE,
    )?;
    let height = questions.number(&format!("height of {screen}"), "m", height, SIDE)?;
    let known: Vec<&str> = pcs.iter().map(|pc| pc.name.as_str()).collect();
    let what = format!("the PC that draws {screen}");
    let hint = format!("a name; known so far: {}", known.join(", "));
    let pc = questions.text(&what, &hint, &format!("render-{screen}"), plain)?;
    let drawn_by = match pcs.iter().position(|known| known.name == pc) {
        Some(known) => known,
        None => {
            let taken: Vec<IpAddr> = pcs.iter().map(|pc| pc.address).collect();
            let next = found::next_address(&taken, this_pc);
            let address = address(questions, &format!("address of {pc}"), next, &taken)?;
            pcs.push(Pc { name: pc, address });
            pcs.len() - 1
        }
    };
    Ok(Wall {
        place,
        width,
        height,
        drawn_by,
    })
}

/// Those that a machine can have.
fn device_names() -> String {
    let forms: Vec<String> = KINDS
        .iter()
        .filter(|kind| kind.on_command_line && kind.id != KindId::Mouse)
        .map(Kind::short_form)
        .collect();
    forms.join(", ")
}

fn stereo(questions: &mut Questions<impl BufRead, impl Write>) -> Result<&'static str, Failure> {
    let names = Stereo::NAMED.map(|(name, _)| name);
    let known = names.join(", ");
    questions.read("stereo", &known, "side-by-side", |text| {
        let name = names.iter().copied().find(|name| *name == text);
        name.ok_or_else(|| format!("write one of {known}"))
    })
}

fn address(
    questions: &mut Questions<impl BufRead, impl Write>,
    what: &str,
    default: IpAddr,
    taken: &[IpAddr],
) -> Result<IpAddr, Failure> {
    let read = |text: &str| {
        match text.parse::<IpAddr>() {
        Ok(ip) if taken.contains(&ip) => Err("another PC has it".to_owned()),
        Ok(ip) if taken.iter().any(|other| other.is_ipv4() != ip.is_ipv4()) => {
            Err("the other PCs have addresses of the other kind, IPv4 or IPv6, between which nothing passes".to_owned())
        }
        Ok(ip) if ip.is_unspecified() || ip.is_multicast() => {
            Err("that is no machine's".to_owned())
        }
        Ok(ip) => Ok(ip),
        Err(_) => Err("write an IP address such as 192.0.2.10".to_owned()),
    }
    };
    let explained = "IP address on the network of the workbench";
    questions.read(what, explained, &default.to_string(), read)
}

/// A machine's name is a file's, too.
fn plain(text: &str) -> Result<(), String> {
    match taut_scene::is_machine_name(text) {
        true => Ok(()),
        false => Err("write letters, digits, `-`, `_` or `.`, a letter or digit first".to_owned()),
    }
}
