//! What a running `taut serve` asked of the system: the class of every thread, so that what strangers can cause never comes before the loops; no core dump.
#![cfg(target_os = "linux")]

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, ChildStderr, Command, Stdio};
use std::time::{Duration, Instant};

use taut_link::create_key_file;

const PATIENCE: Duration = Duration::from_secs(60);

/// How the system schedules a thread.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Class {
    Fifo(u32),
    Normal { nice: i32 },
}

/// Killed when the test ends, however it ends. What it writes must find a reader as long as it runs.
struct Server {
    child: Child,
    stderr: BufReader<ChildStderr>,
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Classes by thread name; of several threads of one name, all.
fn classes(process: u32) -> BTreeMap<String, Vec<Class>> {
    let mut found: BTreeMap<String, Vec<Class>> = BTreeMap::new();
    let tasks = std::fs::read_dir(format!("/proc/{process}/task")).expect("running");
    for task in tasks.flatten() {
        let Ok(stat) = std::fs::read_to_string(task.path().join("stat")) else {
            continue; // it ended meanwhile
        };
        let (head, fields) = stat.rsplit_once(") ").expect("a name in brackets");
        let (_, name) = head.split_once('(').expect("a name in brackets");
        let fields: Vec<&str> = fields.split_whitespace().collect();
        // proc(5): nice is field 19, rt_priority 40, policy 41; the first here is field 3.
        let field = |number: usize| fields[number - 3].parse::<i32>().expect("a number");
        let class = match field(41) {
            libc::SCHED_FIFO => Class::Fifo(field(40).unsigned_abs()),
            _ => Class::Normal { nice: field(19) },
        };
        found.entry(name.to_owned()).or_default().push(class);
    }
    found
}

fn serve(directory: &Path) -> Server {
    create_key_file(&directory.join("cluster.key")).expect("a key");
    let mut file: toml::Table = taut_scene::SHIPPED_WORKBENCH.parse().expect("TOML");
    let mut set = |table: &str, key: &str, value: toml::Value| {
        let table = file.get_mut(table).and_then(toml::Value::as_table_mut);
        table.expect("a table").insert(key.to_owned(), value);
    };
    set("network", "quic_port", 0.into());
    set("network", "udp_port", 0.into());
    set("monitoring", "enabled", false.into());
    let remote = [("kind".to_owned(), toml::Value::from("remote"))];
    file.insert("device".to_owned(), toml::Table::from_iter(remote).into());
    let config = directory.join("workbench.toml");
    std::fs::write(&config, file.to_string()).expect("written");
    let mut child = Command::new(env!("CARGO_BIN_EXE_taut"))
        .args(["serve", "--duration", "60", "--config"])
        .arg(&config)
        .arg("--key")
        .arg(directory.join("cluster.key"))
        .stderr(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .expect("the program");
    let stderr = BufReader::new(child.stderr.take().expect("piped"));
    let mut server = Server { child, stderr };
    let mut said = String::new();
    while server
        .stderr
        .read_line(&mut said)
        .is_ok_and(|read| read > 0)
    {
        if said.contains("serving on") {
            return server;
        }
    }
    panic!("it does not serve: {said}");
}

#[test]
fn the_device_comes_first_then_the_loops_and_strangers_are_of_the_normal_class() {
    let directory = tempfile::tempdir().expect("a directory");
    let server = serve(directory.path());
    let process = server.child.id();
    let wanted = ["device-input", "haptics", "coupling", "broadcast", "frames"];
    let end = Instant::now() + PATIENCE;
    loop {
        let found = classes(process);
        let settled = wanted.iter().all(|name| found.contains_key(*name))
            && found.contains_key("taut-udp")
            && found.get("network").is_some_and(|all| all.len() == 2);
        if settled || Instant::now() > end {
            break;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    // Threads ask for their class at their start: let the last one have asked.
    std::thread::sleep(Duration::from_millis(300));
    let found = classes(process);
    println!("{found:#?}");
    // Where strangers and known peers come in, whether or not the system grants more.
    for name in ["network", "taut-udp", "taut-quic"] {
        for class in found
            .get(name)
            .unwrap_or_else(|| panic!("no thread {name}: {found:?}"))
        {
            let Class::Normal { nice } = class else {
                panic!("{name} is of the real-time class: {class:?}");
            };
            assert!(*nice >= 0, "{name}: {nice}");
        }
    }
    assert_eq!(found["network"], [Class::Normal { nice: 5 }; 2]);
    if !matches!(found["haptics"][..], [Class::Fifo(_)]) {
        println!("the system grants no real-time class: only the normal one was looked at");
        return;
    }
    let expected = [85, 80, 70, 50, 50].map(Class::Fifo);
    for (name, class) in wanted.into_iter().zip(expected) {
        assert_eq!(found[name], [class], "{name}");
    }
    // And nobody else.
    for (name, classes) in &found {
        let is_normal = classes
            .iter()
            .all(|class| matches!(class, Class::Normal { .. }));
        assert!(
            is_normal || wanted.contains(&name.as_str()),
            "{name}: {classes:?}"
        );
    }
}

#[test]
fn a_server_leaves_no_core_dump() {
    let directory = tempfile::tempdir().expect("a directory");
    let server = serve(directory.path());
    let limits = std::fs::read_to_string(format!("/proc/{}/limits", server.child.id()));
    let limits = limits.expect("it runs");
    let core = limits
        .lines()
        .find(|line| line.starts_with("Max core file size"));
    let words: Vec<&str> = core.unwrap_or_default().split_whitespace().collect();
    assert_eq!(words[4..6], ["0", "0"], "{core:?}");
}
