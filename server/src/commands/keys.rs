//! `taut keys`: makes the cluster key, makes credentials from it, and says what a key file allows, never the secret.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use taut_link::{
    Act, ClusterKey, Credential, Holder, JoinKey, JoinPolicy, Role, create_key_file, read_join_key,
    read_key_file, write_credential_file,
};
use taut_proto::proof::{Claim, Grant};
use taut_proto::revocation::ShutOut;
use taut_scene::Workbench;

use crate::cli::KeysArgs;
use crate::shared::failure::Failure;

/// Where a new cluster key goes unless it is said.
const CLUSTER_KEY: &str = "cluster.key";

/// Does what is asked for; what to print.
pub(super) fn run(args: &KeysArgs) -> Result<String, Failure> {
    if let Some(path) = &args.show {
        return Ok(format!(
            "{}: {}",
            path.display(),
            described(&read_join_key(path)?)
        ));
    }
    let Some(master) = &args.master else {
        let path = args.out.clone().unwrap_or_else(|| CLUSTER_KEY.into());
        let key = create_key_file(&path)?;
        return Ok(format!(
            "{}: the master secret of the workbench, server fingerprint {}; keep it on the haptic PC, and make a credential for every other machine with `taut keys --master {0} --config workbench.toml --out DIR`",
            path.display(),
            key.server_pin()
        ));
    };
    let key = read_key_file(master)?;
    let out = args.out.as_deref().ok_or_else(|| {
        Failure::bad_input(
            "credentials need a directory: give --out, a directory with --config, a file with --role",
        )
    })?;
    match (&args.config, args.role) {
        (Some(config), None) => {
            let workbench = Workbench::load(config)?;
            write_all(&key, &workbench, args.issue, out)
        }
        (None, Some(role)) => {
            let holder =
                Holder::of(args.node.as_deref().unwrap_or("*")).map_err(Failure::bad_input)?;
            let credential = key.credential(role, holder, args.issue);
            write_credential_file(out, &credential)?;
            Ok(written(out, &credential))
        }
        _ => Err(Failure::bad_input(
            "say what credentials to make: --config FILE for all of a workbench, or --role ROLE for one",
        )),
    }
}

/// A credential, and what its file is called, without the ending.
pub(super) struct NamedCredential {
    pub(super) name: String,
    pub(super) credential: Credential,
}

/// One credential per node of the workbench and one per other role that it lets in.
pub(super) fn credentials(
    key: &ClusterKey,
    workbench: &Workbench,
    issue: u16,
) -> Result<Vec<NamedCredential>, Failure> {
    let mut wanted: Vec<NamedCredential> = Vec::new();
    let screens = workbench.nodes.iter().map(|node| {
        let holder = Holder::of(&node.name).map_err(Failure::bad_input)?;
        Ok::<_, Failure>((format!("render-{}", node.name), Role::Render, holder))
    });
    let others = Role::NAMED
        .into_iter()
        .filter(|(_, role)| *role != Role::Render)
        .map(|(name, role)| Ok((name.to_owned(), role, Holder::AnyNode)));
    for one in screens.chain(others) {
        let (name, role, holder) = one?;
        let credential = key.credential(role, holder, issue);
        match allowed(&workbench.network.admission, &credential) {
            Ok(()) => {}
            Err(ShutOut::Role(_)) => continue, // nobody of this role is let in: nobody needs it
            Err(error @ ShutOut::Revoked(_)) => {
                return Err(Failure::BadInput(format!(
                    "issue {issue} of {role} {}: {error}; make a later one with --issue",
                    credential.holder()
                )));
            }
        }
        let name = file_name(&name);
        if wanted.iter().any(|other| other.name == name) {
            return Err(Failure::BadInput(format!(
                "two nodes of the workbench would have the file {name}.key; rename one"
            )));
        }
        wanted.push(NamedCredential { name, credential });
    }
    Ok(wanted)
}

/// Writes the credentials of a workbench. Nothing is written if anything is in the way.
fn write_all(
    key: &ClusterKey,
    workbench: &Workbench,
    issue: u16,
    directory: &Path,
) -> Result<String, Failure> {
    let mut wanted: Vec<(PathBuf, Credential)> = Vec::new();
    for NamedCredential { name, credential } in credentials(key, workbench, issue)? {
        let path = directory.join(format!("{name}.key"));
        if path.exists() {
            return Err(Failure::BadInput(format!(
                "{} exists already; choose another directory, or remove it first",
                path.display()
            )));
        }
        wanted.push((path, credential));
    }
    create_private(directory)?;
    let mut report = String::new();
    for (path, credential) in &wanted {
        write_credential_file(path, credential)?;
        // Writing to a string does not fail.
        let _ = writeln!(report, "{}", written(path, credential));
    }
    let _ = write!(
        report,
        "server fingerprint {}; give each machine its own file and keep the master on the haptic PC",
        key.server_pin()
    );
    Ok(report)
}

/// What the workbench's own rules say to a credential.
fn allowed(policy: &JoinPolicy, credential: &Credential) -> Result<(), ShutOut> {
    let issue = credential.issue();
    let (node, grant) = match credential.holder() {
        Holder::Node(node) => (node.as_str(), Grant::Node { issue }),
        Holder::AnyNode => ("", Grant::AnyNode { issue }),
    };
    policy.check(Claim {
        role: credential.role(),
        node,
        grant,
    })
}

/// A name that is one file in every system.
pub(super) fn file_name(name: &str) -> String {
    name.chars()
        .map(|c| match c {
            'a'..='z' | 'A'..='Z' | '0'..='9' | '.' | '_' | '-' => c,
            _ => '_',
        })
        .collect()
}

pub(super) fn create_private(directory: &Path) -> Result<(), Failure> {
    let mut builder = fs::DirBuilder::new();
    builder.recursive(true);
    #[cfg(unix)]
    {
        use std::os::unix::fs::DirBuilderExt;
        builder.mode(0o700);
    }
    builder.create(directory).map_err(|error| {
        Failure::BadInput(format!(
            "{}: the directory cannot be made ({error}); choose another",
            directory.display()
        ))
    })
}

fn written(path: &Path, credential: &Credential) -> String {
    format!(
        "{}: {}, fingerprint {}",
        path.display(),
        holder(credential),
        credential.fingerprint()
    )
}

fn holder(credential: &Credential) -> String {
    let issue = credential.issue();
    let role = credential.role().title();
    match credential.holder() {
        Holder::Node(node) => format!("the {role} \"{node}\", issue {issue}"),
        Holder::AnyNode => format!("any {role}, issue {issue}"),
    }
}

/// What a key file allows.
fn described(key: &JoinKey) -> String {
    let pin = key.pin();
    match key {
        JoinKey::Master(_) => format!(
            "cluster key; its holder may be anything, the server included\n  server fingerprint {pin}"
        ),
        JoinKey::Credential(credential) => {
            let acts = Act::ALL
                .into_iter()
                .filter(|act| credential.role().may(*act))
                .map(Act::name)
                .collect::<Vec<_>>();
            format!(
                "credential of {}\n  may {}\n  fingerprint {}\n  server fingerprint {pin}",
                holder(credential),
                acts.join(", "),
                credential.fingerprint()
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut_scene::SHIPPED_WORKBENCH;

    fn arguments(line: &[&str]) -> KeysArgs {
        use clap::Parser;
        match crate::cli::Cli::try_parse_from([&["taut", "keys"], line].concat())
            .map(|cli| cli.command)
        {
            Ok(Some(crate::cli::Command::Keys(args))) => args,
            other => panic!("{other:?}"),
        }
    }

    fn keys(line: &[&str]) -> Result<String, Failure> {
        run(&arguments(line))
    }

    struct KeyDirectory(tempfile::TempDir);

    impl KeyDirectory {
        fn new() -> Self {
            match tempfile::tempdir() {
                Ok(directory) => Self(directory),
                Err(error) => panic!("{error}"),
            }
        }

        fn path(&self, name: &str) -> String {
            self.0.path().join(name).display().to_string()
        }

        fn write(&self, name: &str, text: &str) -> String {
            let path = self.path(name);
            assert!(fs::write(&path, text).is_ok());
            path
        }
    }

    #[test]
    fn a_workbench_gets_a_credential_for_every_node_and_role_and_none_shows_its_secret() {
        let directory = KeyDirectory::new();
        let master = directory.path("cluster.key");
        let report = keys(&["--out", &master]).expect("no key");
        let config = directory.write("workbench.toml", SHIPPED_WORKBENCH);
        let out = directory.path("out");
        let line = ["--master", &master, "--config", &config, "--out", &out];
        let all = keys(&line).unwrap_or_else(|error| panic!("{error}"));
        let key = read_key_file(Path::new(&master)).expect("no key");
        assert!(report.contains(&key.server_pin().to_string()), "{report}");
        let mut files = 0;
        for entry in fs::read_dir(&out).into_iter().flatten().flatten() {
            let path = entry.path();
            let Ok(JoinKey::Credential(credential)) = read_join_key(&path) else {
                panic!("{} is no credential", path.display());
            };
            assert_eq!(credential.pin(), key.server_pin());
            assert!(all.contains(&credential.fingerprint()), "{all}");
            let Ok(shown) = keys(&["--show", &path.display().to_string()]) else {
                panic!("{} cannot be shown", path.display());
            };
            let text = fs::read_to_string(&path).unwrap_or_default();
            let secret = text
                .lines()
                .find_map(|line| line.strip_prefix("secret "))
                .unwrap_or("none");
            assert_eq!(secret.len(), 64);
            for printed in [&shown, &all] {
                assert!(!printed.contains(&secret[..8]), "{printed}");
            }
            assert!(shown.contains(credential.role().title()), "{shown}");
            files += 1;
        }
        // The shipped workbench has two nodes.
        assert_eq!(files, 2 + 4);
        let again = keys(&line).err().map(|error| error.to_string());
        assert!(again.is_some_and(|text| text.contains("exists already")));
        let shown = keys(&["--show", &master]).unwrap_or_default();
        assert!(shown.contains("anything"), "{shown}");
        assert!(!shown.contains(&key.to_hex()[..8]), "{shown}");
    }

    #[test]
    fn closed_roles_get_none_and_a_revoked_issue_is_not_made_again() {
        let directory = KeyDirectory::new();
        let master = directory.path("cluster.key");
        assert!(keys(&["--out", &master]).is_ok());
        let text = SHIPPED_WORKBENCH.replace(
            "[network]",
            "[network]\nroles = [\"render\", \"device\"]\nrevoked = [\"front#1\"]",
        );
        let config = directory.write("workbench.toml", &text);
        let out = directory.path("out");
        let line = ["--master", &master, "--config", &config, "--out", &out];
        let error = keys(&line).err().map(|error| error.to_string());
        assert!(
            error.as_ref().is_some_and(|text| text.contains("--issue")),
            "{error:?}"
        );
        assert!(!Path::new(&out).exists(), "nothing is written half");
        let made = keys(&[&line[..], &["--issue", "2"]].concat()).unwrap_or_default();
        assert!(
            made.contains("issue 2") && !made.contains("observer"),
            "{made}"
        );
    }

    #[test]
    fn one_credential_can_be_made_alone() {
        let directory = KeyDirectory::new();
        let (master, file) = (directory.path("cluster.key"), directory.path("alice.key"));
        assert!(keys(&["--out", &master]).is_ok());
        let line = ["--master", &master, "--role", "operator", "--node", "alice"];
        assert!(keys(&line).is_err(), "no directory");
        assert!(keys(&[&line[..], &["--out", &file]].concat()).is_ok());
        let Ok(JoinKey::Credential(made)) = read_join_key(Path::new(&file)) else {
            panic!("no credential");
        };
        assert_eq!(made.role(), Role::Operator);
        assert_eq!(made.holder(), &Holder::Node("alice".to_owned()));
        let serves = crate::commands::key::read(Some(Path::new(&file)));
        let text = serves.err().map(|error| error.to_string());
        assert!(text.is_some_and(|text| text.contains("cannot serve")));
    }

    #[cfg(unix)]
    #[test]
    fn a_key_that_others_can_read_is_refused_with_the_command_that_mends_it() {
        use std::os::unix::fs::PermissionsExt;
        let directory = KeyDirectory::new();
        let master = directory.path("cluster.key");
        assert!(keys(&["--out", &master]).is_ok());
        for (mode, good) in [
            (0o600, true),
            (0o400, true),
            (0o640, true),
            (0o644, false),
            (0o620, false),
        ] {
            assert!(fs::set_permissions(&master, fs::Permissions::from_mode(mode)).is_ok());
            let read = read_join_key(Path::new(&master));
            assert_eq!(read.is_ok(), good, "{mode:o}");
            if let Err(error) = read {
                let text = error.to_string();
                assert!(
                    text.contains("chmod 600") && text.contains(&master),
                    "{text}"
                );
            }
        }
    }
}
