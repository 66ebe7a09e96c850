//! `taut push-wrench`: gives a force from outside to a server whose workbench file takes one (`[wrench_in]` with source = "taut").

use std::io::{BufRead, BufReader, Read};
use std::sync::mpsc::{Receiver, TryRecvError, sync_channel};
use std::time::Duration;

use taut_link::{ClientLink, ClientOptions, Role};
use taut_proto::ForceSample;

use crate::cli::PushWrenchArgs;
use crate::commands::key;
use crate::commands::sending::{self, Sending, Sent, Source};
use crate::commands::signals::EndSignal;
use crate::shared::failure::Failure;

/// Longest line of the input, bytes.
const LONGEST_LINE: u64 = 1000;
/// Lines that wait to be sent.
const WAITING_LINES: usize = 64;
type Wrench = [f64; 6];

/// Sends until the duration or the input is over, the user ends it, or the server stops; a server that is lost is joined again. How many values were sent.
pub async fn run(args: &PushWrenchArgs) -> Result<u64, Failure> {
    let key = key::read_to_join(args.key.as_deref())?;
    let signal = EndSignal::listen().map_err(Failure::failed)?;
    let source = match args.wrench {
        Some(wrench) => Wrenches::Constant(wrench),
        None => Wrenches::Lines(lines_of(std::io::stdin())?),
    };
    let options = ClientOptions {
        transport: args.transport.into(),
        ..ClientOptions::new(&args.server, key, Role::Force, &args.node)
    };
    let sending = Sending {
        what: "the force source runs",
        rate: args.rate,
        duration: args.duration,
        policy: args.membership.policy(),
    };
    sending::run(sending, options, signal, source).await
}

/// Where values come from.
enum Wrenches {
    /// The same one in every period.
    Constant(Wrench),
    /// Each line of the input once: who stops writing stops the force.
    Lines(Receiver<Result<Wrench, String>>),
}

/// Why there are no more values.
enum Over {
    /// The input ended.
    Input,
    /// A line is no wrench.
    Bad(String),
}

impl Source for Wrenches {
    fn send(&mut self, link: &ClientLink, index: u64, _since_start: Duration) -> Sent {
        // A value without a time is felt by nobody: the clock is locked a tenth of a second after joining.
        let Some(now) = link.session_now() else {
            return Sent::Nothing;
        };
        match self.newest() {
            Ok(None) => Sent::Nothing,
            Ok(Some(wrench)) => {
                link.send_force(&ForceSample {
                    sample_time_ns: now.ns,
                    clock_uncertainty_ns: now.uncertainty_ns,
                    index,
                    wrench,
                });
                Sent::One
            }
            Err(Over::Input) => Sent::Over(Ok(())),
            Err(Over::Bad(text)) => Sent::Over(Err(Failure::BadInput(text))),
        }
    }
}

impl Wrenches {
    /// The newest value that has not been sent, if there is one.
    fn newest(&mut self) -> Result<Option<Wrench>, Over> {
        let lines = match self {
            Self::Constant(wrench) => return Ok(Some(*wrench)),
            Self::Lines(lines) => lines,
        };
        let mut newest = None;
        loop {
            match lines.try_recv() {
                Ok(Ok(wrench)) => newest = Some(wrench),
                Ok(Err(text)) => return Err(Over::Bad(text)),
                Err(TryRecvError::Empty) => return Ok(newest),
                Err(TryRecvError::Disconnected) => {
                    return newest.map_or(Err(Over::Input), |last| Ok(Some(last)));
                }
            }
        }
    }
}

/// The wrenches of the lines of `input`, read by a thread of their own.
fn lines_of(
    input: impl Read + Send + 'static,
) -> Result<Receiver<Result<Wrench, String>>, Failure> {
    let (sender, lines) = sync_channel(WAITING_LINES);
    std::thread::Builder::new()
        .name("input".to_owned())
        .spawn(move || {
            let mut input = BufReader::new(input);
            for number in 1_u64.. {
                let mut line = String::new();
                let wrench = match input.by_ref().take(LONGEST_LINE).read_line(&mut line) {
                    Ok(0) => return,
                    Ok(_) if line.trim().is_empty() => continue,
                    Ok(_) => parse_wrench(&line),
                    Err(error) => Err(error.to_string()),
                };
                let wrench = wrench.map_err(|why| format!("line {number} of the input: {why}"));
                let is_bad = wrench.is_err();
                if sender.send(wrench).is_err() || is_bad {
                    return;
                }
            }
        })
        .map_err(|error| {
            Failure::failed(format!(
                "the thread of the input cannot be started ({error})"
            ))
        })?;
    Ok(lines)
}

/// Six numbers, separated by commas or blanks: force in N, torque in N m.
pub fn parse_wrench(text: &str) -> Result<Wrench, String> {
    let is_between = |c: char| c == ',' || c.is_whitespace();
    let parts = text.split(is_between).filter(|part| !part.is_empty());
    let numbers: Vec<f64> = parts
        .map(|part| {
            part.parse()
                .ok()
                .filter(|x: &f64| x.is_finite() && x.abs() <= 1e6)
        })
        .collect::<Option<_>>()
        .unwrap_or_default();
    numbers.try_into().map_err(|_| {
        format!(
            "\"{}\" is no wrench; write six numbers from -10^6 to 10^6: force x y z in N, torque x y z in N m, such as 0,0,1,0,0,0",
            text.trim().escape_debug()
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn six_numbers_are_a_wrench_and_nothing_else_is() {
        let wrench = Ok([1.0, -0.5, 2.0, 0.0, 0.25, 0.0]);
        assert_eq!(parse_wrench("1,-0.5,2,0,.25,0"), wrench);
        assert_eq!(parse_wrench(" 1 -0.5\t2 0 0.25 0\n"), wrench);
        for bad in [
            "",
            "1,2,3",
            "1 2 3 4 5 nan",
            "1 2 3 4 5 inf",
            "1 2 3 4 5 1e30",
            "1 2 3 4 5 6 7",
            "x",
        ] {
            let why = parse_wrench(bad).expect_err(bad);
            assert!(why.contains("six numbers"), "{why}");
        }
    }

    #[test]
    fn each_line_is_one_value_and_a_bad_one_is_named() {
        let lines = lines_of("1 0 0 0 0 0\n\n2 0 0 0 0 0\nnan 0 0 0 0 0\n9 0 0 0 0 0\n".as_bytes());
        let all: Vec<_> = lines
            .unwrap_or_else(|error| panic!("{error}"))
            .iter()
            .collect();
        assert_eq!(all.len(), 3, "nothing behind the bad one: {all:?}");
        assert_eq!(all[1], Ok([2.0, 0.0, 0.0, 0.0, 0.0, 0.0]));
        assert!(
            all[2].as_ref().is_err_and(|why| why.contains("line 4")),
            "{all:?}"
        );
    }
}
