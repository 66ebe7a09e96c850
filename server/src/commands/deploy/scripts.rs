//! `install` and `uninstall` of a machine: short shell scripts, to be read before they are run.

use std::fmt::Write as _;
use std::path::Path;

use taut_scene::{Machine, shell_word};

use super::archive::{File, Mode};
use super::units::Unit;
use crate::commands::keys::file_name;

/// What is to be done on one machine.
pub(super) struct Scripts<'p> {
    pub(super) workbench: &'p str,
    pub(super) machine: &'p Machine,
    /// Below `etc/` in the archive and `/etc/taut` on the machine.
    pub(super) files: &'p [File],
    pub(super) units: &'p [Unit],
    pub(super) has_firewall: bool,
}

impl Scripts<'_> {
    fn has(&self, is_session: bool) -> bool {
        self.units.iter().any(|unit| unit.is_session == is_session)
    }

    fn names(&self, is_session: bool) -> String {
        let of = self
            .units
            .iter()
            .filter(|unit| unit.is_session == is_session);
        of.map(|unit| unit.name.as_str())
            .collect::<Vec<_>>()
            .join(" ")
    }

    fn begin(&self, what: &str, usage: &str) -> String {
        format!(
            "#!/bin/sh\n# {what} {} of the workbench {:?}; a second time does no harm. Run it as root: {usage}\n",
            self.machine.name, self.workbench
        )
    }

    /// The session's credential on the machine: its owner is the account that draws.
    fn key_of_session(&self) -> Option<String> {
        let mut files = self.files.iter();
        files.find(|file| self.is_of_session(file)).map(installed)
    }

    /// A render node's credential is read by the account that draws, everything else by `taut`.
    fn is_of_session(&self, file: &File) -> bool {
        let mut nodes = self.machine.nodes.iter();
        nodes.any(|node| {
            let key = format!("etc/render-{}.key", file_name(node));
            file.path == Path::new(&key)
        })
    }

    /// Sets the machine up; a second time does no harm.
    pub(super) fn install(&self) -> String {
        let session = self.has(true);
        let usage = if session {
            "sudo ./install [ACCOUNT]"
        } else {
            "sudo ./install"
        };
        let mut text = self.begin("Sets up", usage);
        if session {
            text.push_str("# ACCOUNT is the one whose graphical session draws the screens; without it, the one that calls sudo.\n");
        }
        text.push_str(
            "set -eu\ncd \"$(dirname \"$0\")\"\nfail() { echo \"install: $*\" >&2; exit 1; }\n",
        );
        let _ = writeln!(
            text,
            "[ \"$(id -u)\" = 0 ] || fail \"run it as root: {usage}\""
        );
        text.push_str("command -v taut >/dev/null || fail \"the program is not here: apt install ./taut_*.deb, or copy taut to /usr/local/bin\"\n");
        if session {
            text.push_str(
                "account=${1:-${SUDO_USER:-}}\n\
                 [ -n \"$account\" ] || fail \"say whose graphical session draws the screens: ./install ACCOUNT\"\n\
                 id \"$account\" >/dev/null 2>&1 || fail \"there is no account $account here\"\n",
            );
        }
        text.push_str("\n# What an earlier archive set up goes first: this one may not have it.\nif [ -x /etc/taut/uninstall ]; then /etc/taut/uninstall >/dev/null; fi\n");
        if self.has(false) {
            text.push_str("\n# The account taut, which runs the services.\nsystemd-sysusers \"$PWD/taut.sysusers\"\n");
        }
        text.push_str("\n# Configuration; a secret belongs to the account that reads it.\ninstall -d -m 0755 /etc/taut\ninstall -m 0755 uninstall /etc/taut/uninstall\n");
        for file in self.files {
            let owner = match (file.mode, self.is_of_session(file)) {
                (Mode::Secret, true) => " -o \"$account\"",
                (Mode::Secret, false) => " -o taut -g taut",
                _ => "",
            };
            let _ = writeln!(
                text,
                "install -D -m {:04o}{owner} {} {}",
                file.mode.bits(),
                shell_word(&file.path.display().to_string()),
                installed(file),
            );
        }
        self.install_services(&mut text);
        text
    }

    fn install_services(&self, text: &mut String) {
        text.push_str("\n# Services.\n");
        if self.has(false) {
            let units = self.names(false);
            let _ = write!(
                text,
                "(cd units && install -m 0644 {units} /etc/systemd/system)\n\
                 systemctl enable {units}\n\
                 if [ -d /run/systemd/system ]; then systemctl daemon-reload; systemctl restart {units}; fi\n"
            );
        }
        if self.has(true) {
            let units = self.names(true);
            let _ = write!(
                text,
                "install -d -m 0755 /etc/systemd/user\n\
                 (cd units && install -m 0644 {units} /etc/systemd/user)\n\
                 su -l -s /bin/sh \"$account\" -c 'SYSTEMD_OFFLINE=1 systemctl --user enable {units}'\n\
                 echo \"$account draws from the next login on; now: systemctl --user daemon-reload && systemctl --user start {units}\"\n"
            );
        }
        if self.has_firewall {
            text.push_str("echo \"if this machine has a firewall: nft -f /etc/taut/firewall.nft, for good as its first lines say\"\n");
        }
    }

    /// Takes away what `install` put there; `install` keeps it as `/etc/taut/uninstall`.
    pub(super) fn uninstall(&self) -> String {
        let usage = "sudo /etc/taut/uninstall";
        let mut text = self.begin("Takes taut away from", usage);
        text.push_str("# The program, the account taut and what was recorded stay.\nset -eu\n");
        let _ = writeln!(
            text,
            "[ \"$(id -u)\" = 0 ] || {{ echo \"uninstall: run it as root: {usage}\" >&2; exit 1; }}"
        );
        if let Some(key) = self.key_of_session() {
            let units = self.names(true);
            let _ = write!(
                text,
                "account=$(stat -c %U {key} 2>/dev/null || true) # whose session draws; none: nothing to do\n\
                 if [ -n \"$account\" ]; then\n\
                 \x20 if [ -d \"/run/user/$(id -u \"$account\")/systemd\" ]; then systemctl --user -M \"$account@\" stop {units} || true; fi\n\
                 \x20 su -l -s /bin/sh \"$account\" -c 'SYSTEMD_OFFLINE=1 systemctl --user disable {units}' || true\n\
                 fi\n"
            );
            for unit in self.units.iter().filter(|unit| unit.is_session) {
                let _ = writeln!(text, "rm -f /etc/systemd/user/{}", unit.name);
            }
        }
        if self.has(false) {
            let units = self.names(false);
            let _ = write!(
                text,
                "if [ -d /run/systemd/system ]; then systemctl stop {units} || true; fi\n\
                 systemctl disable {units} || true # not there: nothing to do\n"
            );
            for unit in self.units.iter().filter(|unit| !unit.is_session) {
                let _ = writeln!(text, "rm -f /etc/systemd/system/{}", unit.name);
            }
            text.push_str("if [ -d /run/systemd/system ]; then systemctl daemon-reload; fi\n");
        }
        for file in self.files {
            let _ = writeln!(text, "rm -f {}", installed(file));
        }
        text.push_str("rm -f /etc/taut/uninstall\n# Folders that are empty now.\nfind /etc/taut -depth -type d -empty -delete 2>/dev/null || true\n");
        if self.has_firewall {
            text.push_str("echo \"if its rules were loaded or included in /etc/nftables.conf, take them out there: nft -a list chain inet filter input\"\n");
        }
        text
    }
}

/// Where a file of the archive is on the machine, as a word of a shell command.
fn installed(file: &File) -> String {
    let path = file.path.strip_prefix("etc").unwrap_or(&file.path);
    shell_word(&format!("/etc/taut/{}", path.display()))
}
