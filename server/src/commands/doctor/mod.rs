//! `taut doctor`: what this machine lacks for real time and for rendering, with the command that mends each.

pub(crate) mod device;
mod plugged;

use std::fmt;
use std::time::Duration;

use serde::Serialize;
use taut_bridge::haply::ServiceAddress;
use taut_bridge::realtime::{
    AWAKE, RealtimeGrant, keep_cores_awake, may_lock_memory, monotonic_now, request_fifo,
    sharpen_timers, sleep_until,
};
use taut_bridge::{HidPort, ReportPort, SourceError};
use taut_kinds::{KINDS, Kind};
use taut_link::Distribution;

use crate::shared::timing::Histogram;

/// Period of the haptics loop, whose deadlines the measurement keeps.
const PERIOD: Duration = Duration::from_millis(1);
/// How long timers are measured: 1000 periods.
const MEASURED_PERIODS: u32 = 1000;
/// Priority of the haptics loop.
const FIFO_PRIORITY: u8 = 80;
/// A wake-up later than this costs a tenth of a period, us.
const GOOD_LATENESS_US: f64 = 100.0;
/// A tenth of a second of states at 1 kHz for one client, bytes.
const GOOD_SOCKET_BUFFER: u64 = 100 * 1200;

/// What was found.
#[derive(Clone, Debug, Serialize)]
pub(super) struct DoctorReport {
    /// One entry per question.
    pub findings: Vec<Finding>,
    /// How late a thread woke at 1 kHz deadlines for a second.
    pub timer_lateness_us: Distribution,
    /// Whether that thread had the real-time class.
    pub timer_realtime: bool,
}

/// The answer to one question.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Finding {
    /// What was looked at.
    pub what: &'static str,
    /// Whether it is as a workbench needs it.
    pub good: bool,
    /// What was found.
    pub found: String,
    /// The command that mends it; absent where nothing needs mending.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mend: Option<String>,
}

impl Finding {
    fn good(what: &'static str, found: impl Into<String>) -> Self {
        Self {
            what,
            good: true,
            found: found.into(),
            mend: None,
        }
    }

    fn lacking(what: &'static str, found: impl Into<String>, mend: impl Into<String>) -> Self {
        Self {
            what,
            good: false,
            found: found.into(),
            mend: Some(mend.into()),
        }
    }
}

impl fmt::Display for DoctorReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, finding) in self.findings.iter().enumerate() {
            let (newline, mark) = (
                if index > 0 { "\n" } else { "" },
                if finding.good { "ok" } else { "--" },
            );
            write!(f, "{newline}{mark}  {}: {}", finding.what, finding.found)?;
            if let Some(mend) = &finding.mend {
                write!(f, "\n    mend: {mend}")?;
            }
        }
        Ok(())
    }
}

/// Looks at this machine; takes a second and a little.
pub(super) fn examine() -> std::io::Result<DoctorReport> {
    let (grant, lateness) = measure_timers()?;
    let timer_realtime = grant.is_granted();
    let mut findings = vec![
        scheduling(&grant),
        memory_lock(may_lock_memory(), limit_of("Max locked memory")),
        idle_cores(&keep_cores_awake().0),
        timers(&lateness),
        kernel(
            std::fs::read_to_string("/sys/kernel/realtime")
                .ok()
                .as_deref(),
        ),
        socket_buffer("receive buffer of sockets", "net.core.rmem_max"),
        socket_buffer("send buffer of sockets", "net.core.wmem_max"),
    ];
    findings.extend(rendering());
    findings.extend(devices());
    findings.extend(plugged::force_devices(&ServiceAddress::default()));
    Ok(DoctorReport {
        findings,
        timer_lateness_us: lateness,
        timer_realtime,
    })
}

/// Sleeps to 1 kHz deadlines on a thread of the real-time class, if that is granted.
fn measure_timers() -> std::io::Result<(RealtimeGrant, Distribution)> {
    let thread = std::thread::Builder::new()
        .name("timer check".into())
        .spawn(|| {
            let grant = request_fifo(FIFO_PRIORITY);
            if !grant.is_granted() {
                // The answer shows in the measurement.
                let _ = sharpen_timers();
            }
            let lateness = Histogram::default();
            let mut deadline = monotonic_now();
            for _ in 0..MEASURED_PERIODS {
                deadline += PERIOD;
                sleep_until(deadline);
                lateness.record_time(monotonic_now().saturating_sub(deadline));
            }
            (grant, lateness.distribution_us())
        })?;
    thread
        .join()
        .map_err(|_| std::io::Error::other("the measurement of the timers broke down"))
}

/// The drivers, and the input device that is plugged in. None of it is needed.
fn devices() -> [Finding; 2] {
    let named = KINDS.iter().filter(|kind| kind.on_command_line);
    let forms: Vec<String> = named.map(Kind::short_form).collect();
    let space_mouse = match HidPort.open() {
        Ok(source) => Finding::good("SpaceMouse", format!("{} can be read", source.name())),
        Err(error @ SourceError::NotOpened { .. }) => Finding::lacking(
            "SpaceMouse",
            "one is plugged in but cannot be opened",
            error.to_string(),
        ),
        Err(error) => Finding::good("SpaceMouse", error.to_string()),
    };
    [
        Finding::good("device drivers", forms.join(", ")),
        space_mouse,
    ]
}

fn scheduling(grant: &RealtimeGrant) -> Finding {
    const WHAT: &str = "real-time scheduling";
    match grant {
        RealtimeGrant::Granted { what } => Finding::good(WHAT, format!("{what} is granted")),
        RealtimeGrant::Waived { what, why } => Finding::lacking(
            WHAT,
            format!("{what} is not granted: {why}"),
            "echo \"@realtime - rtprio 99\" | sudo tee -a /etc/security/limits.d/99-taut.conf && sudo groupadd -f realtime && sudo usermod -aG realtime $USER  # then log in again",
        ),
    }
}

fn memory_lock(allowed: bool, limit: Option<String>) -> Finding {
    const WHAT: &str = "memory lock";
    match limit.as_deref() {
        _ if allowed => Finding::good(WHAT, "any amount of memory may be locked"),
        Some(bytes) => Finding::lacking(
            WHAT,
            format!(
                "only {bytes} bytes may be locked, so a page of a loop may have to be fetched from disk"
            ),
            "echo \"@realtime - memlock unlimited\" | sudo tee -a /etc/security/limits.d/99-taut.conf && sudo groupadd -f realtime && sudo usermod -aG realtime $USER  # then log in again",
        ),
        None => Finding::good(WHAT, "not known on this system"),
    }
}

fn idle_cores(grant: &RealtimeGrant) -> Finding {
    const WHAT: &str = "idle cores";
    match grant {
        RealtimeGrant::Granted { .. } => Finding::good(WHAT, "are kept awake while a session runs"),
        RealtimeGrant::Waived { .. } => Finding::lacking(
            WHAT,
            format!(
                "may sleep deeply between two ticks and wake late and cold: {AWAKE} cannot be written"
            ),
            "echo 'KERNEL==\"cpu_dma_latency\", GROUP=\"realtime\", MODE=\"0660\"' | sudo tee /etc/udev/rules.d/99-taut.rules && sudo groupadd -f realtime && sudo usermod -aG realtime $USER && sudo udevadm control --reload && sudo udevadm trigger --name-match=cpu_dma_latency  # then log in again",
        ),
    }
}

fn timers(lateness: &Distribution) -> Finding {
    const WHAT: &str = "timers";
    let found = format!(
        "at 1 kHz a thread wakes {:.0} us late in the median, {:.0} us at p99, {:.0} us at worst",
        lateness.p50, lateness.p99, lateness.max
    );
    if lateness.p99 <= GOOD_LATENESS_US {
        Finding::good(WHAT, found)
    } else {
        Finding::lacking(
            WHAT,
            found,
            "sudo apt-get install linux-image-rt-amd64  # or: stop other programs, and sudo cpupower frequency-set -g performance",
        )
    }
}

fn kernel(realtime: Option<&str>) -> Finding {
    let found = match realtime.map(str::trim) {
        Some("1") => "fully preemptible (PREEMPT_RT)",
        _ => "not fully preemptible: fine where the timers above are good",
    };
    Finding::good("kernel", found)
}

fn socket_buffer(what: &'static str, key: &'static str) -> Finding {
    let path = format!("/proc/sys/{}", key.replace('.', "/"));
    let bytes = std::fs::read_to_string(path)
        .ok()
        .and_then(|text| text.trim().parse::<u64>().ok());
    match bytes {
        None => Finding::good(what, "not known on this system"),
        Some(bytes) if bytes >= GOOD_SOCKET_BUFFER => {
            Finding::good(what, format!("up to {bytes} bytes"))
        }
        Some(bytes) => Finding::lacking(
            what,
            format!("up to {bytes} bytes"),
            format!("sudo sysctl -w {key}={}", 8 * GOOD_SOCKET_BUFFER),
        ),
    }
}

/// The soft limit of this process, by its name in the process file system.
fn limit_of(name: &str) -> Option<String> {
    let limits = std::fs::read_to_string("/proc/self/limits").ok()?;
    let line = limits.lines().find_map(|line| line.strip_prefix(name))?;
    line.split_whitespace().next().map(str::to_owned)
}

fn rendering() -> Option<Finding> {
    const WHAT: &str = "rendering";
    Some(match crate::commands::render::adapter()? {
        Ok((adapter, false)) => Finding::good(WHAT, format!("draws with {adapter}")),
        Ok((adapter, true)) => Finding::lacking(
            WHAT,
            format!("draws with {adapter}; that is software: slow, and good for tests"),
            "a graphics card and its driver, where this machine is to draw the screens of a workbench; else nothing",
        ),
        Err(reason) => Finding::lacking(
            WHAT,
            reason,
            "sudo apt-get install libvulkan1 mesa-vulkan-drivers  # software; or the driver of your graphics card",
        ),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whatever_is_lacking_comes_with_a_command() {
        let lacking = [
            memory_lock(false, Some("65536".into())),
            timers(&Distribution {
                p99: 900.0,
                ..Distribution::default()
            }),
            scheduling(&RealtimeGrant::Waived {
                what: "SCHED_FIFO".into(),
                why: "no".into(),
            }),
            idle_cores(&RealtimeGrant::Waived {
                what: "cores awake while idle".into(),
                why: "no".into(),
            }),
        ];
        for finding in lacking {
            assert!(!finding.good && finding.mend.is_some(), "{finding:?}");
        }
        assert!(memory_lock(true, Some("65536".into())).good);
    }

    /// Both are lines of one file, in whatever order they are run.
    #[test]
    fn the_command_for_a_limit_keeps_the_lines_of_another() {
        let waived = RealtimeGrant::Waived {
            what: "SCHED_FIFO".into(),
            why: "no".into(),
        };
        for finding in [
            scheduling(&waived),
            memory_lock(false, Some("65536".into())),
        ] {
            let mend = finding.mend.expect("a command");
            let adds = "| sudo tee -a /etc/security/limits.d/99-taut.conf ";
            assert!(mend.contains(adds), "{mend}");
        }
    }

    #[test]
    fn the_examination_measures_a_second_of_timers() {
        let report = examine().expect("the examination broke down");
        assert_eq!(report.timer_lateness_us.count, u64::from(MEASURED_PERIODS));
        assert!(
            report
                .findings
                .iter()
                .any(|finding| finding.what == "real-time scheduling")
        );
    }
}
