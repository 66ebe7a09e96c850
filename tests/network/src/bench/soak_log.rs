//! What a soak writes down, row by row into a CSV file: the resources of each process at quiet moments, and each broken promise. A soak that
//! was cut off goes on with the same file. Whether resources grow is judged from the rows.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Write;
use std::path::Path;
use std::time::Instant;

use super::BenchError;
use super::memory::Resources;

const HEADER: &str = "elapsed_s,process,resident_bytes,descriptors,threads,broken_promise";
/// Moments of a process that a judgement takes: one in each quarter.
const FEWEST_MOMENTS: usize = 4;
/// Growth of resident memory that is none: the allocator keeps an arena for each thread, and gives pages back late. A process whose clients
/// have come and gone for minutes swings by 10 MiB without a trend. In eight hours the medians are five hours apart: a leak of 1 KiB per
/// second adds 18 MiB.
const RESIDENT_ALLOWANCE: f64 = 12.0 * 1024.0 * 1024.0;
/// The same as a share of what there was.
const RESIDENT_SHARE: f64 = 0.05;
/// Descriptors more that are no growth: an observer's connection that is closed is let go a moment later, beside the next one.
const DESCRIPTORS_ALLOWANCE: f64 = 2.0;

/// A process at a quiet moment: as many peers as at the other moments.
#[derive(Clone, Debug, PartialEq)]
struct Moment {
    process: String,
    resources: Resources,
}

/// The log of a soak.
#[derive(Debug)]
pub struct SoakLog {
    file: Option<File>,
    start: Instant,
    /// Time that was soaked before, s.
    before_s: f64,
    moments: Vec<Moment>,
    broken: Vec<String>,
}

/// Resources of one process in the second and in the last quarter of its life: the first is its start.
#[derive(Clone, Debug, PartialEq)]
pub struct Growth {
    /// Name and time of its start.
    pub process: String,
    /// Which resource.
    pub what: &'static str,
    /// Medians of the two quarters.
    pub medians: [f64; 2],
    /// Most that the second median may be.
    pub limit: f64,
}

impl Growth {
    /// Whether it is more than the machine's own.
    #[must_use]
    pub fn is_growth(&self) -> bool {
        self.medians[1] > self.limit
    }
}

impl SoakLog {
    /// A log in memory alone, or one that is in a file, too: what the file has already is part of it.
    pub fn open(path: Option<&Path>) -> Result<SoakLog, BenchError> {
        let mut log = SoakLog {
            file: None,
            start: Instant::now(),
            before_s: 0.0,
            moments: Vec::new(),
            broken: Vec::new(),
        };
        let Some(path) = path else {
            return Ok(log);
        };
        let named =
            |error: std::io::Error| BenchError::Missing(format!("{}: {error}", path.display()));
        let text = match std::fs::read_to_string(path) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => String::new(),
            text => text.map_err(named)?,
        };
        // A row that was cut off with the machine has no end.
        let whole = text.rfind('\n').map_or("", |end| &text[..=end]);
        for (number, row) in whole.lines().enumerate() {
            let known = if number == 0 {
                row == HEADER
            } else {
                log.read(row).is_some()
            };
            if !known {
                return Err(BenchError::Missing(format!(
                    "{}, line {}: no row of a soak's log; name another file",
                    path.display(),
                    number + 1
                )));
            }
        }
        let mut file = File::options()
            .create(true)
            .append(true)
            .open(path)
            .map_err(named)?;
        file.set_len(whole.len() as u64).map_err(named)?;
        if whole.is_empty() {
            writeln!(file, "{HEADER}").map_err(named)?;
        }
        log.file = Some(file);
        Ok(log)
    }

    fn read(&mut self, row: &str) -> Option<()> {
        let [
            elapsed_s,
            process,
            resident_bytes,
            descriptors,
            threads,
            broken,
        ] = row.split(',').collect::<Vec<_>>().try_into().ok()?;
        let elapsed_s: f64 = elapsed_s.parse().ok()?;
        self.before_s = self.before_s.max(elapsed_s);
        if !broken.is_empty() {
            self.broken.push(broken.to_owned());
            return Some(());
        }
        let resources = Resources {
            resident_bytes: resident_bytes.parse().ok()?,
            descriptors: descriptors.parse().ok()?,
            threads: threads.parse().ok()?,
        };
        let process = process.to_owned();
        self.moments.push(Moment { process, resources });
        Some(())
    }

    /// Time soaked so far, that of earlier parts included, s.
    pub fn elapsed_s(&self) -> f64 {
        self.before_s + self.start.elapsed().as_secs_f64()
    }

    /// A name for a process that starts now.
    pub fn name(&self, process: &str) -> String {
        format!("{process} from {:.1} s", self.elapsed_s())
    }

    /// Writes down what `process`, by its number, has now.
    pub fn note(&mut self, process: &str, number: u32) -> Result<(), BenchError> {
        let resources = Resources::of(number)?;
        self.write(&format!(
            "{process},{},{},{},",
            resources.resident_bytes, resources.descriptors, resources.threads
        ))?;
        let process = process.to_owned();
        self.moments.push(Moment { process, resources });
        Ok(())
    }

    /// Writes down a promise that was broken.
    pub fn broke(&mut self, what: &str) -> Result<(), BenchError> {
        let what = what.replace([',', '\n', '\r'], ";");
        self.write(&format!("soak,,,,{what}"))?;
        self.broken.push(what);
        Ok(())
    }

    fn write(&mut self, row: &str) -> Result<(), BenchError> {
        let elapsed_s = self.elapsed_s();
        match &mut self.file {
            Some(file) => Ok(writeln!(file, "{elapsed_s:.1},{row}")?),
            None => Ok(()),
        }
    }

    /// Promises that were broken, one sentence each.
    pub fn broken(&self) -> &[String] {
        &self.broken
    }

    /// Resources of each process that lived long enough.
    pub fn growth(&self) -> Vec<Growth> {
        let mut processes = BTreeMap::<&str, Vec<Resources>>::new();
        for moment in &self.moments {
            let of_process = processes.entry(&moment.process).or_default();
            of_process.push(moment.resources);
        }
        let long = processes
            .iter()
            .filter(|(_, all)| all.len() >= FEWEST_MOMENTS);
        long.flat_map(|(process, all)| judged(process, all))
            .collect()
    }
}

fn judged(process: &str, all: &[Resources]) -> [Growth; 3] {
    let quarter = all.len() / 4;
    let growth = |what, read: fn(&Resources) -> u64, allowance: fn(f64) -> f64| {
        let of = |part: &[Resources]| {
            let mut values: Vec<u64> = part.iter().map(read).collect();
            values.sort_unstable();
            values[values.len() / 2] as f64
        };
        let medians = [
            of(&all[quarter..2 * quarter]),
            of(&all[all.len() - quarter..]),
        ];
        Growth {
            process: process.to_owned(),
            what,
            medians,
            limit: medians[0] + allowance(medians[0]),
        }
    };
    [
        growth(
            "resident memory",
            |r| r.resident_bytes,
            |level| RESIDENT_ALLOWANCE + RESIDENT_SHARE * level,
        ),
        // As many peers, as many of these.
        growth("descriptors", |r| r.descriptors, |_| DESCRIPTORS_ALLOWANCE),
        growth("threads", |r| r.threads, |_| 0.0),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn log_of(moments: impl Iterator<Item = Resources>) -> SoakLog {
        let mut log = SoakLog::open(None).unwrap_or_else(|error| panic!("{error}"));
        log.moments = moments
            .map(|resources| Moment {
                process: "server from 0.0 s".to_owned(),
                resources,
            })
            .collect();
        log
    }

    fn grown(log: &SoakLog) -> Vec<&'static str> {
        let all = log.growth();
        let grown = all.iter().filter(|growth| growth.is_growth());
        grown.map(|growth| growth.what).collect()
    }

    #[test]
    fn a_start_and_a_wobble_are_no_growth_and_a_leak_is() {
        let wobble = |number: u64| Resources {
            resident_bytes: (if number < 10 { 10 } else { 50 } + number % 3) << 20,
            descriptors: if number < 10 { 5 } else { 20 },
            threads: 9,
        };
        assert_eq!(grown(&log_of((0..100).map(wobble))), [""; 0]);
        let leaks = |number: u64| Resources {
            resident_bytes: wobble(number).resident_bytes + number * 500_000,
            descriptors: wobble(number).descriptors + number / 15,
            ..wobble(number)
        };
        let leaky = log_of((0..100).map(leaks));
        assert_eq!(grown(&leaky), ["resident memory", "descriptors"]);
        // Nothing is said of what lived for a moment.
        assert!(log_of((0..3).map(leaks)).growth().is_empty());
    }

    #[test]
    fn a_soak_that_was_cut_off_goes_on_with_its_file() {
        let folder = tempfile::tempdir().unwrap_or_else(|error| panic!("{error}"));
        let path = folder.path().join("soak.csv");
        let open = || SoakLog::open(Some(&path));
        let mut log = open().unwrap_or_else(|error| panic!("{error}"));
        let name = log.name("soak");
        assert!(log.note(&name, std::process::id()).is_ok());
        assert!(log.broke("a state, out of order").is_ok());
        let cut = |text: String| text + "7.5,soak,12";
        let text = std::fs::read_to_string(&path).unwrap_or_default();
        assert!(std::fs::write(&path, cut(text)).is_ok());

        let mut again = open().unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(again.moments, log.moments);
        assert_eq!(again.broken(), ["a state; out of order"]);
        assert!(again.note("next", std::process::id()).is_ok());
        let third = open().unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(third.moments, again.moments);
        assert!(third.elapsed_s() >= log.before_s);

        assert!(std::fs::write(&path, "t,x,y,z\n").is_ok());
        let error = open().err().map(|error| error.to_string());
        assert!(error.is_some_and(|text| text.contains("line 1")));
    }
}
