//! `taut deploy`: one archive for each machine of the workbench, with what that machine needs and no other's secret.

mod archive;
mod firewall;
mod output;
mod scripts;
mod units;

use std::fmt::Write as _;
use std::fs;
use std::net::SocketAddr;
use std::path::{Component, Path, PathBuf};

use taut_link::{ClusterKey, check_secret_file, read_key_file};
use taut_scene::{Machine, NeededFile, Workbench};
use zeroize::Zeroizing;

use archive::{File, Mode, pack};
use scripts::Scripts;
pub(super) use units::reached_by_a_service;
use units::{Unit, units};

use super::keys::{NamedCredential, credentials, file_name};
use super::live_scene::refuse_to_follow;
use crate::cli::DeployArgs;
use crate::shared::failure::Failure;

/// Account of the services.
const SYSUSERS: &str = include_str!("../../../../docs/systemd/taut.sysusers");

/// Makes the archives; what to print.
pub(super) fn run(args: &DeployArgs) -> Result<String, Failure> {
    // Tokens and devices are those of another machine: what a session would refuse there is not asked here.
    let reports = taut_scene::check(std::slice::from_ref(&args.config));
    if let Some(report) = reports.iter().find(|report| !report.is_good()) {
        return Err(Failure::bad_input(report));
    }
    let workbench = Workbench::load(&args.config)?;
    if args.follow_scene {
        refuse_to_follow(&workbench)?; // as the service would, when it starts
    }
    let Some(server) = workbench.machines.iter().find(|machine| machine.server) else {
        return Err(Failure::BadInput(format!(
            "{} names no machines; write a [[machine]] for each, with name, address and what it does (docs/deployment.md)",
            args.config.display()
        )));
    };
    let master = args.master.as_ref().or(workbench.network.key_file.as_ref());
    let master = master.ok_or_else(|| {
        Failure::bad_input("which cluster key? make one with `taut keys --out cluster.key`, and name it by --master")
    })?;
    let key = read_key_file(master)?;
    let plan = Plan {
        config: &args.config,
        workbench: &workbench,
        address: SocketAddr::new(server.address, workbench.network.quic_port),
        credentials: credentials(&key, &workbench, args.issue)?,
        follow_scene: args.follow_scene,
        key,
    };
    let mut archives = Vec::new();
    for machine in &workbench.machines {
        let name = format!("taut-{}.tar.gz", machine.name);
        let (content, holds) = plan.archive(machine)?;
        archives.push(output::Archive {
            name,
            content,
            holds,
        });
    }
    let changed = output::write(&args.out, &archives, args.force)?;
    Ok(report(&args.out, &archives, &workbench, changed))
}

/// What each archive is made from.
struct Plan<'w> {
    config: &'w Path,
    workbench: &'w Workbench,
    /// Where the clients reach the server.
    address: SocketAddr,
    key: ClusterKey,
    credentials: Vec<NamedCredential>,
    /// The server's unit takes up edited files.
    follow_scene: bool,
}

impl Plan<'_> {
    /// The archive of one machine, and in a few words what it holds.
    fn archive(&self, machine: &Machine) -> Result<(Vec<u8>, String), Failure> {
        let mut files = self.secrets(machine)?;
        let firewall = firewall::rules(self.workbench, machine);
        let has_firewall = firewall.is_some();
        files.extend(firewall.map(|rules| File::new("etc/firewall.nft", Mode::Plain, rules)));
        if machine.server {
            add(&mut files, self.configuration()?)?;
        }
        add(&mut files, self.screen_files(machine)?)?;
        let units = units(self.workbench, machine, self.address, self.follow_scene)?;
        let scripts = Scripts {
            workbench: &self.workbench.name,
            machine,
            files: &files,
            units: &units,
            has_firewall,
        };
        let mut all = vec![
            File::new("install", Mode::Program, scripts.install()),
            File::new("uninstall", Mode::Program, scripts.uninstall()),
        ];
        if units.iter().any(|unit| !unit.is_session) {
            all.push(File::new("taut.sysusers", Mode::Plain, SYSUSERS));
        }
        let holds = holds(&files, &units);
        all.extend(
            units
                .into_iter()
                .map(|unit| File::new(Path::new("units").join(unit.name), Mode::Plain, unit.text)),
        );
        all.extend(files);
        let packed = pack(&format!("taut-{}", machine.name), &all);
        let packed = packed.map_err(|error| {
            Failure::Failed(format!(
                "the archive of {} cannot be packed: {error}",
                machine.name
            ))
        })?;
        Ok((packed, holds))
    }

    /// The keys of one machine: the server's is the cluster key, which makes all others.
    fn secrets(&self, machine: &Machine) -> Result<Vec<File>, Failure> {
        let mut names: Vec<String> = machine
            .nodes
            .iter()
            .map(|node| format!("render-{}", file_name(node)))
            .collect();
        names.extend(machine.device.is_some().then(|| "device".to_owned()));
        names.extend(machine.tracker.is_some().then(|| "tracker".to_owned()));
        let mut files = Vec::new();
        for name in names {
            let held = self.credentials.iter().find(|held| held.name == name);
            let held = held.ok_or_else(|| {
                Failure::BadInput(format!(
                    "{} needs the credential {name}, but `roles` in [network] lets its role not in; add it there",
                    machine.name
                ))
            })?;
            let text = Zeroizing::new(held.credential.to_text());
            files.push(File::new(
                format!("etc/{name}.key"),
                Mode::Secret,
                text.as_bytes(),
            ));
        }
        if machine.server {
            let text = Zeroizing::new(format!("{}\n", &*self.key.to_hex()));
            files.push(File::new("etc/cluster.key", Mode::Secret, text.as_bytes()));
        }
        Ok(files)
    }

    /// What the nodes of a machine read for their screens, beside their credentials.
    fn screen_files(&self, machine: &Machine) -> Result<Vec<File>, Failure> {
        let nodes = self.workbench.nodes.iter();
        let drawn = nodes.filter(|node| machine.nodes.contains(&node.name));
        let names = drawn.flat_map(|node| self.workbench.screen_files(node));
        let folder = self.config.parent().unwrap_or(Path::new(""));
        let file = |name: &str| {
            let found = self.workbench.screen_file(name);
            let place = Path::new("etc").join(below(folder, &found)?);
            Ok(File::new(place, Mode::Plain, read(&found)?))
        };
        names.map(file).collect()
    }

    /// The workbench file as it is, and what it names, where it names it.
    fn configuration(&self) -> Result<Vec<File>, Failure> {
        let folder = self.config.parent().unwrap_or(Path::new(""));
        let mut files = vec![File::new(
            "etc/workbench.toml",
            Mode::Plain,
            read(self.config)?,
        )];
        for needed in self.workbench.needed_files()? {
            let (place, found, mode) = match needed {
                NeededFile::Named(path) => (below(folder, &path)?, path, Mode::Plain),
                NeededFile::Secret(path) => {
                    check_secret_file(&path)
                        .map_err(|why| Failure::BadInput(format!("{}: {why}", path.display())))?;
                    (below(folder, &path)?, path, Mode::Secret)
                }
                NeededFile::OfScene {
                    by_mesh: true,
                    found,
                    ..
                } if !found.is_file() => continue,
                NeededFile::OfScene {
                    scene, name, found, ..
                } => {
                    let scene = Path::new(&scene);
                    let beside = match scene.is_file() {
                        true => scene.parent().unwrap_or(Path::new("")).join(name),
                        false => folder.join("data").join(name),
                    };
                    (below(folder, &beside)?, found, Mode::Plain)
                }
            };
            let place = Path::new("etc").join(place);
            if files.iter().all(|file| file.path != place) {
                files.push(File {
                    path: place,
                    mode,
                    content: Zeroizing::new(read(&found)?),
                });
            }
        }
        self.writes_where_it_may()?;
        self.operator_has_a_token()?;
        Ok(files)
    }

    /// The service may write to its own folder alone.
    fn writes_where_it_may(&self) -> Result<(), Failure> {
        let (monitoring, operator) = (&self.workbench.monitoring, &self.workbench.operator);
        let record = monitoring.record.as_ref().filter(|_| monitoring.enabled);
        let recordings = operator.recordings.as_ref().filter(|_| operator.enabled);
        for (path, key, what) in [
            (record, "`record` in [monitoring]", "file"),
            (recordings, "`recordings` in [operator]", "folder"),
        ] {
            if let Some(path) = path.filter(|path| !path.starts_with("/var/lib/taut")) {
                return Err(Failure::BadInput(format!(
                    "{key} of {} is {}, where the service may not write; write a {what} in \"/var/lib/taut\"",
                    self.config.display(),
                    path.display()
                )));
            }
        }
        Ok(())
    }

    /// A service has no terminal on which it could show a fresh token.
    fn operator_has_a_token(&self) -> Result<(), Failure> {
        let operator = &self.workbench.operator;
        if operator.enabled && operator.token_file.is_none() {
            return Err(Failure::BadInput(format!(
                "[operator] of {} names no token_file, without which the service does not start; make one beside it: openssl rand -hex 32 > operator.token && chmod 600 operator.token",
                self.config.display()
            )));
        }
        Ok(())
    }
}

/// Adds what the workbench file names, each file once: one with the name of another would be written over it when the archive is unpacked.
fn add(files: &mut Vec<File>, named: Vec<File>) -> Result<(), Failure> {
    for file in named {
        match files.iter().find(|known| known.path == file.path) {
            None => files.push(file),
            Some(known) if *known.content == *file.content => {}
            Some(_) => {
                let name = file.path.strip_prefix("etc").unwrap_or(&file.path);
                return Err(Failure::BadInput(format!(
                    "the archive calls another file {0}; give the {0} beside the workbench file another name, and write that in the workbench file",
                    name.display()
                )));
            }
        }
    }
    Ok(())
}

/// Where a file is below the workbench file's folder, which is where it will be below /etc/taut.
fn below(folder: &Path, path: &Path) -> Result<PathBuf, Failure> {
    let inside = path.strip_prefix(folder).ok().filter(|inside| {
        inside
            .components()
            .all(|part| matches!(part, Component::Normal(_) | Component::CurDir))
    });
    inside.map(|inside| inside.components().filter(|part| *part != Component::CurDir).collect()).ok_or_else(|| {
        Failure::BadInput(format!(
            "{} is not below the workbench file's folder, so it cannot be copied with it; move it there, and name it by its path from there",
            path.display()
        ))
    })
}

fn read(path: &Path) -> Result<Vec<u8>, Failure> {
    fs::read(path).map_err(|error| {
        Failure::BadInput(format!(
            "{}: {error}; check the path and its permissions",
            path.display()
        ))
    })
}

fn holds(files: &[File], units: &[Unit]) -> String {
    let secrets = files.iter().filter(|file| file.mode == Mode::Secret);
    let secrets = secrets
        .filter_map(|file| file.path.file_name())
        .map(|name| name.to_string_lossy().into_owned());
    let units = units.iter().map(|unit| unit.name.clone());
    units.chain(secrets).collect::<Vec<_>>().join(", ")
}

fn report(
    out: &Path,
    archives: &[output::Archive],
    workbench: &Workbench,
    changed: bool,
) -> String {
    let mut text = String::new();
    for (archive, machine) in archives.iter().zip(&workbench.machines) {
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "{}: for {}, {} bytes: {}",
            out.join(&archive.name).display(),
            machine.address,
            archive.content.len(),
            archive.holds
        );
    }
    if !changed {
        text.push_str("nothing was changed: these archives were there already\n");
    }
    for stray in output::strays(out, archives) {
        let _ = writeln!(
            text,
            "{} is of no machine of this workbench; a credential may be in it: remove it",
            stray.display()
        );
    }
    text.push_str("copy each to its machine and to no other; there: tar xzf ARCHIVE, then `install` in the folder it makes");
    text
}
