//! What a running `taut serve` asked of the system: the class of every thread, so that what strangers can cause never comes before the loops; no core dump.
#![cfg(target_os = "linux")]

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use crate::support::{PATIENCE, Running, Workplace, wait_until, workbench};

/// How the system schedules a thread.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Class {
    Fifo(u32),
    Normal { nice: i32 },
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

/// A server of a bridge, without one.
fn serve() -> (Workplace, Running) {
    let place = Workplace::new();
    let mut file: toml::Table = workbench().parse().expect("TOML");
    let remote = [("kind".to_owned(), toml::Value::from("remote"))];
    file.insert("device".to_owned(), toml::Table::from_iter(remote).into());
    place.write("workbench.toml", &file.to_string());
    let server = Running::start(&place.serve("workbench.toml", "60", &[]));
    wait_until("it serves", || server.says("serving on"));
    (place, server)
}

#[test]
fn the_device_comes_first_then_the_loops_and_strangers_are_of_the_normal_class() {
    let (_place, server) = serve();
    let process = server.id();
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
    let (_place, server) = serve();
    let limits = std::fs::read_to_string(format!("/proc/{}/limits", server.id()));
    let limits = limits.expect("it runs");
    let core = limits
        .lines()
        .find(|line| line.starts_with("Max core file size"));
    let words: Vec<&str> = core.unwrap_or_default().split_whitespace().collect();
    assert_eq!(words[4..6], ["0", "0"], "{core:?}");
}
