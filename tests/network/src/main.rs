//! Prints the table of the cluster's targets with what this machine keeps of them now:
//! `cargo run --release -p taut-network-tests -- [--quick] [--soak S] [--log FILE] [--seconds S] [--taut PROGRAM] [--csv FILE] [SECTION...]`.
//!
//! `-- --node SERVER NAME udp|quic KEY SECONDS` is one node of a network of namespaces or machines, see `scripts/netns-cluster`.
//!
//! Exit code 1 where a measured target is not met, 2 where something could not be measured at all or the arguments are wrong.

use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use taut_network_tests::bench::scale::Place;
use taut_network_tests::bench::{client_process, leader_process, node};
use taut_network_tests::report::{Extent, Row, SECTIONS, Section, Verdict, csv, table};

struct Arguments {
    extent: Extent,
    csv: Option<PathBuf>,
    sections: Vec<Section>,
}

fn main() -> ExitCode {
    run().unwrap_or_else(|error| {
        eprintln!("taut-network-tests: {error}");
        ExitCode::from(2)
    })
}

type Run = Result<ExitCode, Box<dyn Error>>;

fn run() -> Run {
    let mut arguments = std::env::args().skip(1).peekable();
    let process = match arguments.peek().map(String::as_str) {
        Some("--client") => client,
        Some("--lead") => lead,
        Some("--node") => one_node,
        Some("--help") => {
            print!("{}", help());
            return Ok(ExitCode::SUCCESS);
        }
        _ => return report(read(arguments)?),
    };
    process(&arguments.skip(1).collect::<Vec<_>>())
}

/// A process of the isolation run: a client that can be stopped.
fn client(words: &[String]) -> Run {
    let [server, node, transport, key] = words else {
        return Err("--client takes SERVER NODE TRANSPORT KEY".into());
    };
    client_process::client(server, node, transport, key.as_ref())?;
    Ok(ExitCode::SUCCESS)
}

/// The server of the fail-over run, which is killed.
fn lead(words: &[String]) -> Run {
    let [quic, udp, key, timeout_ms] = words else {
        return Err("--lead takes QUIC UDP KEY MILLISECONDS".into());
    };
    let node_timeout = Duration::from_millis(timeout_ms.parse()?);
    leader_process::lead(quic, udp, key.as_ref(), node_timeout)?;
    Ok(ExitCode::SUCCESS)
}

/// One node of a network of namespaces or machines.
fn one_node(words: &[String]) -> Run {
    let [server, node, transport, key, seconds] = words else {
        return Err("--node takes SERVER NODE udp|quic KEY SECONDS".into());
    };
    let transport = client_process::transport_of(transport);
    let seconds = Duration::from_secs_f64(positive(seconds)?);
    let got = node::run(server, node, transport, key.as_ref(), seconds)?;
    println!(
        "{node}: joined in {:.3} s, {} states, {} lost, {} refused, {} out of order; latency p50 {:.2} ms, p99 {:.2} ms, clock +-{:.3} ms",
        got.joined_s,
        got.states,
        got.lost,
        got.refused,
        got.disordered,
        got.latency_ms.p50,
        got.latency_ms.p99,
        got.clock_ms
    );
    let good = got.states > 0 && got.disordered == 0;
    Ok(ExitCode::from(u8::from(!good)))
}

/// Runs the sections that are wanted.
fn report(arguments: Arguments) -> Run {
    let (mut rows, mut broken) = (Vec::<Row>::new(), false);
    for section in arguments.sections {
        eprintln!("{}: {}", section.name, section.about);
        match (section.run)(&arguments.extent) {
            Ok(new) => {
                eprint!("{}", table(&new));
                rows.extend(new);
            }
            Err(error) => {
                broken = true;
                rows.push(Row::unknown(section.about, "", error));
            }
        }
    }
    print!("{}", table(&rows));
    if let Some(file) = arguments.csv {
        std::fs::write(&file, csv(&rows))
            .map_err(|error| format!("{}: {error}", file.display()))?;
    }
    let missed = rows.iter().any(|row| row.verdict == Verdict::Missed);
    Ok(ExitCode::from(if broken { 2 } else { u8::from(missed) }))
}

fn help() -> String {
    let sections = SECTIONS
        .iter()
        .map(|section| format!("  {:<10} {}\n", section.name, section.about));
    format!(
        "\
Prints the table of the cluster's targets with what this machine keeps of them now.

taut-network-tests [OPTION...] [SECTION...]

  --quick          seconds instead of minutes: invariants, no speeds
  --seconds S      length of each latency or age run
  --turns N        turns of the isolation runs, each without and with clients
  --soak S         length of each of the two soaks
  --log FILE       CSV file of a soak's resources and broken promises; one that was cut off goes on with it. Each soak has its own
  --namespaces NAME ADDRESS
                   section `scale` starts client K in the network namespace NAME K, and serves at ADDRESS; scripts/netns-scale does it
  --taut PROGRAM   the program that serves and draws; build it by cargo build --release -p taut
  --csv FILE       writes the table, too

Sections, all of them unless some are named:
{}
Exit code 1: a target is missed. 2: something could not be measured, or the arguments are wrong.
Examples: taut-network-tests --taut target/release/taut skew screens
          taut-network-tests --soak 28800 --log soak-links.csv soak
          taut-network-tests --taut target/release/taut --soak 28800 --log soak-program.csv soak-program
",
        sections.collect::<String>()
    )
}

fn read(mut arguments: impl Iterator<Item = String>) -> Result<Arguments, Box<dyn Error>> {
    let this = std::env::current_exe()?;
    let (mut extent, mut csv, mut wanted) = (Extent::full(&this), None, Vec::new());
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or(format!("{argument} needs a value"));
        match argument.as_str() {
            "--quick" => {
                extent = Extent {
                    program: extent.program,
                    ..Extent::quick(&this)
                }
            }
            "--soak" => extent.soak_seconds = Some(positive(&value()?)?),
            "--log" => extent.soak_log = Some(value()?.into()),
            "--namespaces" => extent.place = Place::Namespaces(value()?, value()?.parse()?),
            "--seconds" => extent.seconds = positive(&value()?)?,
            "--turns" => extent.turns = positive(&value()?)?.ceil() as usize,
            // Some of those that run it do so from a folder of their own.
            "--taut" => extent.program = program(&value()?)?,
            "--csv" => csv = Some(value()?.into()),
            option if option.starts_with('-') => {
                return Err(format!("there is no option `{option}`; --help lists them").into());
            }
            name => {
                let known = SECTIONS.iter().find(|section| section.name == name);
                let names: Vec<_> = SECTIONS.iter().map(|section| section.name).collect();
                let unknown = || {
                    format!(
                        "there is no section `{name}`; there are {}",
                        names.join(", ")
                    )
                };
                wanted.push(*known.ok_or_else(unknown)?);
            }
        }
    }
    Ok(Arguments {
        extent,
        csv,
        sections: if wanted.is_empty() {
            SECTIONS.to_vec()
        } else {
            wanted
        },
    })
}

/// The program by its whole path.
fn program(named: &str) -> Result<PathBuf, String> {
    let path = std::path::absolute(named).map_err(|error| format!("{named}: {error}"))?;
    if path.is_file() {
        Ok(path)
    } else {
        Err(format!(
            "there is no program {}; build it: cargo build --release -p taut",
            path.display()
        ))
    }
}

fn positive(text: &str) -> Result<f64, String> {
    let number = text
        .parse()
        .ok()
        .filter(|number| *number > 0.0 && f64::is_finite(*number));
    number.ok_or_else(|| format!("`{text}` is no positive number"))
}
