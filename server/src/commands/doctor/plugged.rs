//! Force devices that are plugged in: what they can render, and the stiffness that their rate and delay bear. None of it is needed, and nothing is
//! moved: the Inverse service is asked for states alone, serial ports are listed and not spoken to, vendors' libraries are loaded and not called.

use std::time::Duration;

use taut_bridge::haply::{self, HaplyError, HaplyFound, ServiceAddress};
use taut_bridge::{
    DeviceChoice, Grip, HaplySettings, InputChoice, PluggedPort, VENDOR_LIBRARIES, VendorLibrary,
    VendorLibraryState, plugged_ports,
};

use super::Finding;

/// Period of the haptics loop, s.
const PERIOD_S: f64 = 1e-3;

/// What is there.
pub(super) fn force_devices(service: &ServiceAddress) -> Vec<Finding> {
    let mut findings = vec![inverse_service(service)];
    match plugged_ports() {
        Ok(ports) if ports.is_empty() => {
            findings.push(Finding::good(
                "serial and HID ports",
                "no force device's port is there",
            ));
        }
        Ok(ports) => findings.extend(ports.iter().map(port)),
        Err(cause) => findings.push(Finding::good("serial and HID ports", cause)),
    }
    findings.extend(vendors_libraries());
    findings
}

/// Each that is there; where none is, a sentence.
fn vendors_libraries() -> Vec<Finding> {
    let found: Vec<Finding> = VENDOR_LIBRARIES
        .iter()
        .filter_map(|library| vendors_library(library, &library.state()))
        .collect();
    if !found.is_empty() {
        return found;
    }
    let each = VENDOR_LIBRARIES.map(|library| format!("{} ({})", library.file, library.vendor));
    let none = format!(
        "none of {} is where the system's loader looks; one elsewhere is named by its plug-in's option library=PATH",
        each.join(", ")
    );
    vec![Finding::good("vendors' libraries", none)]
}

fn vendors_library(library: &VendorLibrary, state: &VendorLibraryState) -> Option<Finding> {
    const WHAT: &str = "vendor's library";
    let VendorLibrary {
        vendor,
        file,
        plugin,
    } = library;
    match state {
        VendorLibraryState::Absent => None,
        VendorLibraryState::Loads => Some(Finding::good(
            WHAT,
            format!(
                "{file} ({vendor}) can be loaded; build its plug-in device-bridge/plugins/{plugin}.c as docs/devices.md says, and read it by --device plugin:./taut_{plugin}.so"
            ),
        )),
        VendorLibraryState::Broken(cause) => Some(Finding::lacking(
            WHAT,
            format!("{file} ({vendor}) is there and cannot be loaded: {cause}"),
            if cause.contains("undefined symbol: xdr_") {
                "LD_PRELOAD=libtirpc.so.3 taut doctor  # it needs that library and does not say so"
                    .to_owned()
            } else {
                format!(
                    "LD_DEBUG=libs taut doctor 2>&1 | grep -A9 {file}  # shows which file it is, and what it lacks: install that"
                )
            },
        )),
    }
}

fn inverse_service(service: &ServiceAddress) -> Finding {
    const WHAT: &str = "Haply Inverse service";
    match haply::look(service) {
        Ok(found) if found.said.arms.is_empty() => Finding::lacking(
            WHAT,
            format!("answers at {service}, but has no arm"),
            "plug the arm in, with its power supply",
        ),
        Ok(found) => Finding::good(WHAT, of_service(service, &found)),
        Err(HaplyError::NoService(..)) => Finding::good(WHAT, format!("none answers at {service}")),
        Err(error) => Finding::lacking(WHAT, error.to_string(), "install a newer Inverse service"),
    }
}

fn of_service(service: &ServiceAddress, found: &HaplyFound) -> String {
    let arms: Vec<String> = found
        .said
        .arms
        .iter()
        .map(|arm| format!("{} {}", arm.model.as_deref().unwrap_or("arm"), arm.id))
        .collect();
    let grips = match found.said.grips.len() {
        0 => "no grip: 3 degrees of freedom sensed".to_owned(),
        count => format!("{count} grip(s): 6 degrees of freedom sensed"),
    };
    let at = |share: f64| {
        let place = (found.answers.len() as f64 * share) as usize;
        found.answers.get(place).copied().unwrap_or_default()
    };
    let us = |time: Duration| time.as_micros();
    let arm = HaplySettings::default().force_device();
    let late = at(0.99).as_secs_f64();
    format!(
        "{} at {service}, {grips}, 3 actuated (force, no torque); answers in {} us, p99 {} us; {}; read it by --device haply={service}",
        arms.join(", "),
        us(at(0.5)),
        us(at(0.99)),
        bears(&arm.grip, late.max(arm.delay_s), arm.grip.max_force, None),
    )
}

/// A sentence's part on what a device of these mechanics renders when its force is `delay_s` late beyond the loop's own period.
fn bears(grip: &Grip, delay_s: f64, force: f64, torque: Option<f64>) -> String {
    let (along, about) = grip.critical_stiffness(PERIOD_S, PERIOD_S + delay_s);
    let turning = torque.map_or_else(String::new, |torque| {
        format!(", {torque:.2} N m and {about:.2} N m/rad")
    });
    format!(
        "by mechanics that are assumed, not measured, it renders {force:.0} N and bears {along:.0} N/m with nobody to hold it{turning}"
    )
}

fn port(port: &PluggedPort) -> Finding {
    let read_by = match (&port.device, port.device.as_deref().map(str::parse)) {
        (Some(device), Some(Ok(DeviceChoice::Input(input)))) => {
            format!("{}; read it by --device {device}", of_input(&input))
        }
        _ => "of no device that is known here".to_owned(),
    };
    Finding::good("port", format!("{} ({}): {read_by}", port.path, port.what))
}

fn of_input(input: &InputChoice) -> String {
    let Some(device) = input.force_device() else {
        return "no force".to_owned();
    };
    let (force, torque) = input
        .strongest()
        .unwrap_or((device.grip.max_force, device.grip.max_torque));
    bears(
        &device.grip,
        device.delay_s,
        force,
        device.renders_torque.then_some(torque),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut_bridge::Hand;
    use taut_bridge::haply::{HaplyService, SimulatedInverse, SimulatedSettings};

    #[test]
    fn a_service_that_answers_is_named_with_what_its_arm_bears() {
        let inverse = SimulatedInverse::new(&SimulatedSettings::held(Hand::LIGHT));
        let any = "127.0.0.1:0".parse().expect("an address");
        let service = HaplyService::start(any, inverse).expect("a free port");
        let address: ServiceAddress = service.address().to_string().parse().expect("an address");
        let finding = inverse_service(&address);
        for part in [
            "inverse3 51A3",
            "1 grip(s)",
            "no torque",
            "renders 5 N",
            "N/m",
            "p99",
        ] {
            assert!(finding.found.contains(part), "{part}: {finding:?}");
        }
        assert!(finding.good);
        drop(service);
        let finding = inverse_service(&address);
        assert!(
            finding.good && finding.found.contains("none answers"),
            "{finding:?}"
        );
    }

    #[test]
    fn a_port_says_what_may_be_there() {
        let of = |device: Option<&str>| {
            port(&PluggedPort {
                path: "/dev/ttyUSB0".to_owned(),
                what: "0403:6001, FTDI".to_owned(),
                device: device.map(str::to_owned),
                is_its_board: false,
            })
            .found
        };
        let spidar = of(Some("spidar:/dev/ttyUSB0"));
        assert!(
            spidar.contains("--device spidar:/dev/ttyUSB0") && spidar.contains("N m/rad"),
            "{spidar}"
        );
        assert!(of(None).contains("no device that is known"));
    }
}
