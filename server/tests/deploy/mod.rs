//! `taut deploy`: what is in each machine's archive, and that what is in them works together.

mod following;
mod misuse;

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

use flate2::read::GzDecoder;
use taut_scene::SHIPPED_WORKBENCH;
use toml::{Table, Value};

use crate::support::{Running, Workplace, taut, wait_until};

const MACHINES: &str = r#"
[[machine]]
name = "haptic-pc"
address = "127.0.0.1"
server = true
[[machine]]
name = "left"
address = "127.0.0.2"
nodes = ["front"]
[[machine]]
name = "right"
address = "127.0.0.3"
nodes = ["table"]
[[machine]]
name = "device-pc"
address = "127.0.0.4"
device = "simulated"
"#;

/// A loopback address of this process: the ports of a workbench that is deployed are fixed, and one that was free just now is somebody else's by the time
/// that the server starts.
fn own_address() -> String {
    let [_, high, middle, low] = std::process::id().to_be_bytes();
    format!("127.{}.{middle}.{low}", 64 + high % 64)
}

/// The shipped workbench on four machines, with a scene of its own beside it.
fn workbench() -> String {
    let mut file: Table = SHIPPED_WORKBENCH.parse().expect("shipped");
    for (table, key, value) in [
        ("network", "bind", Value::from(own_address())),
        ("monitoring", "enabled", Value::from(false)),
    ] {
        let table = file.get_mut(table).and_then(Value::as_table_mut);
        table.expect("shipped").insert(key.to_owned(), value);
    }
    let remote = Table::from_iter([("kind".to_owned(), Value::from("remote"))]);
    file.insert("device".to_owned(), remote.into());
    file.insert("scene".to_owned(), "scenes/mine.toml".into());
    let machines = MACHINES.replace("127.0.0.1", &own_address());
    let machines: Table = machines.parse().expect("tables");
    file.extend(machines);
    file.to_string()
}

fn prepared() -> Workplace {
    let place = Workplace::new();
    place.write("workbench.toml", &workbench());
    fs::create_dir(place.path("scenes")).expect("a folder");
    let scene = include_str!("../../scenes/sphere-on-plane.toml");
    place.write("scenes/mine.toml", scene);
    let hand = include_str!("../../scenes/sphere-on-plane.csv");
    place.write("scenes/sphere-on-plane.csv", hand);
    place
}

fn deploy(place: &Workplace, more: &[&str]) -> (Option<i32>, String) {
    let (config, key, out) = (
        place.text("workbench.toml"),
        place.text("cluster.key"),
        place.text("out"),
    );
    let mut line = vec!["deploy", &config, "--master", &key, "--out", &out];
    line.extend(more);
    let output = taut(&line);
    let said = String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned();
    (output.status.code(), said)
}

/// The same of what is good: what it says.
fn deployed(place: &Workplace, more: &[&str]) -> String {
    let (code, said) = deploy(place, more);
    assert_eq!(code, Some(0), "{said}");
    said
}

/// And of what is not.
fn refused(place: &Workplace, more: &[&str]) -> String {
    let (code, said) = deploy(place, more);
    assert_eq!(code, Some(2), "{said}");
    said
}

/// Writes the workbench file with a change of this.
fn with_change(place: &Workplace, change: impl FnOnce(&mut Table)) {
    let mut table: Table = workbench().parse().expect("a workbench");
    change(&mut table);
    place.write("workbench.toml", &table.to_string());
}

/// A file that its owner alone may read.
fn write_secret(place: &Workplace, name: &str, text: &str) {
    place.write(name, text);
    let own = fs::Permissions::from_mode(0o600);
    fs::set_permissions(place.path(name), own).expect("its mode");
}

/// Unpacks a machine's archive as `tar xzf` does; the folder that it makes.
fn unpacked(place: &Workplace, machine: &str) -> PathBuf {
    let name = format!("taut-{machine}");
    let file = fs::File::open(place.path(&format!("out/{name}.tar.gz"))).expect("an archive");
    let to = place.path(&format!("on-{machine}"));
    let archive = tar::Archive::new(GzDecoder::new(file)).unpack(&to);
    archive.expect("unpacks");
    to.join(name)
}

/// All files below a folder.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("a folder").flatten();
    entries
        .flat_map(|entry| match entry.path() {
            path if path.is_dir() => files(&path),
            path => vec![path],
        })
        .collect()
}

/// What is secret in a key file: the credential's line, or the cluster key.
fn secret_of(path: &Path) -> String {
    let text = fs::read_to_string(path).expect("text");
    let line = text.lines().find_map(|line| line.strip_prefix("secret "));
    let secret = line.unwrap_or(text.trim()).to_owned();
    assert_eq!(secret.len(), 64, "{}", path.display());
    secret
}

/// The words of the unit's command, with `folder` in place of /etc/taut.
fn command(folder: &Path, unit: &str) -> Vec<String> {
    let text = fs::read_to_string(folder.join("units").join(unit)).expect("a unit");
    let line = text
        .lines()
        .find_map(|line| line.strip_prefix("ExecStart=taut "));
    let etc = folder.join("etc").display().to_string();
    let words = line.expect("a command").split(' ');
    words.map(|word| word.replace("/etc/taut", &etc)).collect()
}

#[test]
fn each_machine_gets_its_own_secret_and_no_other() {
    let place = prepared();
    deployed(&place, &[]);
    let keys = [
        ("haptic-pc", "cluster.key"),
        ("left", "render-front.key"),
        ("right", "render-table.key"),
        ("device-pc", "device.key"),
    ];
    let folders = keys.map(|(machine, _)| unpacked(&place, machine));
    let secrets: Vec<String> = (0..keys.len())
        .map(|which| secret_of(&folders[which].join("etc").join(keys[which].1)))
        .collect();
    assert_eq!(secrets[0], secret_of(&place.path("cluster.key")));
    for (which, folder) in folders.iter().enumerate() {
        for file in files(folder) {
            let content = fs::read(&file).expect("readable");
            for (other, secret) in secrets.iter().enumerate() {
                let holds = content.windows(64).any(|part| part == secret.as_bytes());
                let is_own = other == which && file.ends_with(keys[which].1);
                assert_eq!(holds, is_own, "{} of {}", file.display(), keys[other].0);
            }
            let mode = fs::metadata(&file).expect("there").permissions().mode() & 0o777;
            let name = file.file_name().and_then(|name| name.to_str());
            let expected = match name {
                Some(name) if name.ends_with(".key") => 0o600,
                Some("install" | "uninstall") => 0o755,
                _ => 0o644,
            };
            assert_eq!(mode, expected, "{}", file.display());
            assert!(
                content.windows(8).all(|part| part != b"TAUT_SER"),
                "an environment file"
            );
        }
    }
    let config = folders[0].join("etc/workbench.toml").display().to_string();
    let checked = taut(&["check", &config]);
    assert!(checked.status.success(), "{checked:?}");
    for file in ["mine.toml", "sphere-on-plane.csv"] {
        assert!(folders[0].join("etc/scenes").join(file).is_file(), "{file}");
    }
    // A render PC opens no port but to the others that draw.
    let rules = fs::read_to_string(folders[1].join("etc/firewall.nft")).expect("rules");
    assert!(
        rules.contains("ip saddr { 127.0.0.3 } udp dport 32768-60999 accept"),
        "{rules}"
    );
    assert!(!folders[3].join("etc/firewall.nft").exists());
}

#[test]
fn a_second_run_changes_nothing_and_another_workbench_is_not_written_over_the_first() {
    let place = prepared();
    deployed(&place, &[]);
    let all = || -> Vec<Vec<u8>> {
        let mut there = files(&place.path("out"));
        there.sort();
        there
            .iter()
            .map(|path| fs::read(path).expect("readable"))
            .collect()
    };
    let first = all();
    assert_eq!(first.len(), 4);
    let said = deployed(&place, &[]);
    assert!(said.contains("nothing was changed"), "{said}");
    let changed = workbench().replace("eye_separation = 0.064", "eye_separation = 0.06");
    place.write("workbench.toml", &changed);
    let said = refused(&place, &[]);
    assert!(
        said.contains("--force") && said.contains("haptic-pc"),
        "{said}"
    );
    assert!(all() == first, "something was written");
    deployed(&place, &["--force"]);
    assert!(all() != first);
    assert_eq!(all().len(), 4);
}

#[test]
fn a_workbench_with_faults_is_refused_with_its_lines_and_leaves_nothing() {
    let place = prepared();
    let good = workbench();
    for (from, to, part) in [
        ("0.064", "-0.064", "eye_separation"),
        (
            "nodes = [\"front\"]",
            "nodes = [\"fronnt\"]",
            "known nodes: front, table",
        ),
        (
            "nodes = [\"table\"]",
            "device = \"simulated\"",
            "\"table\" is on no machine",
        ),
        ("127.0.0.3", "127.0.0.2", "same address"),
        ("127.0.0.3", "render-2", "IP address"),
        ("server = true", "server = false", "haptic PC"),
        (
            "device = \"simulated\"",
            "device = \"simulatd\"",
            "simulatd",
        ),
        ("scenes/mine.toml", "../mine.toml", "mine.toml"),
    ] {
        assert!(good.contains(from), "{from}");
        place.write("workbench.toml", &good.replace(from, to));
        let said = refused(&place, &[]);
        assert!(said.contains(part), "{part}: {said}");
        assert!(!place.path("out").exists(), "{to}");
    }
    // A file outside the folder would be missing on the other side.
    let outside = Workplace::new();
    outside.write(
        "mine.toml",
        include_str!("../../scenes/sphere-on-plane.toml"),
    );
    outside.write(
        "sphere-on-plane.csv",
        include_str!("../../scenes/sphere-on-plane.csv"),
    );
    let far = good.replace("scenes/mine.toml", &outside.text("mine.toml"));
    place.write("workbench.toml", &far);
    let said = refused(&place, &[]);
    assert!(said.contains("not below"), "{said}");
}

#[test]
fn processes_of_two_archives_join_each_other() {
    let place = prepared();
    deployed(&place, &[]);
    let (haptic, device) = (unpacked(&place, "haptic-pc"), unpacked(&place, "device-pc"));
    let mut bridge = command(&device, "taut-bridge.service");
    bridge.push("--json".to_owned());
    // The service waits for its server, whichever machine starts first.
    let bridge = Running::start(&bridge);
    let server = Running::start(&command(&haptic, "taut-serve.service"));
    wait_until("the bridge joins", || server.says("bridge joined as"));
    std::thread::sleep(Duration::from_millis(500));
    let printed = bridge.end("-INT").stdout;
    let report: serde_json::Value = serde_json::from_slice(&printed).expect("a report");
    assert_eq!(report["sessions"], 1, "{report}");
    assert!(report["packets_received"].as_u64() > Some(0), "{report}");
}

#[test]
fn files_of_screens_go_to_the_machine_that_draws_them_beside_its_credential() {
    let place = prepared();
    with_change(&place, |table| {
        let screen = table["screen"][0].as_table_mut().expect("a screen");
        screen.insert("blend".to_owned(), "masks/front.pfm".into());
    });
    let (code, said) = deploy(&place, &[]);
    assert!(code != Some(0) && said.contains("front.pfm"), "{said}");
    fs::create_dir(place.path("masks")).expect("a folder");
    // As large as the window that shows the screen.
    let light = 1.0_f32.to_le_bytes().repeat(1280 * 427);
    let mask = [b"Pf\n1280 427\n-1.0\n".as_slice(), &light].concat();
    fs::write(place.path("masks/front.pfm"), mask).expect("written");
    deployed(&place, &[]);
    for (machine, has) in [("left", true), ("right", false), ("haptic-pc", true)] {
        let there = unpacked(&place, machine)
            .join("etc/masks/front.pfm")
            .exists();
        assert_eq!(there, has, "{machine}");
    }
}

#[test]
fn what_meshes_are_read_with_is_in_the_archive_beside_them() {
    let place = prepared();
    let scenery = [("part", "part.obj"), ("plate", "Plate.GLTF")].map(|(name, file)| {
        format!("[[scenery]]\nname = \"{name}\"\nshape = {{ mesh = \"parts/{file}\" }}\n")
    });
    let scene = include_str!("../../scenes/sphere-on-plane.toml").to_owned() + &scenery.concat();
    place.write("scenes/mine.toml", &scene);
    fs::create_dir(place.path("scenes/parts")).expect("a folder");
    let part = "mtllib part.mtl\nusemtl red\nv 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nf 1 2 3\n";
    place.write("scenes/parts/part.obj", part);
    place.write("scenes/parts/part.mtl", "newmtl red\nKd 1 0 0\n");
    let triangle = [0.0_f32, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 0.1, 0.0];
    let bytes = triangle.map(f32::to_le_bytes).concat();
    fs::write(place.path("scenes/parts/plate.bin"), bytes).expect("written");
    let plate = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"buffers":[{"uri":"plate.bin","byteLength":36}],
        "bufferViews":[{"buffer":0,"byteLength":36}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[0.1,0.1,0]}]}"#;
    place.write("scenes/parts/Plate.GLTF", plate);
    deployed(&place, &[]);
    let etc = unpacked(&place, "haptic-pc").join("etc");
    for file in ["part.obj", "part.mtl", "Plate.GLTF", "plate.bin"] {
        assert!(etc.join("scenes/parts").join(file).is_file(), "{file}");
    }
    // There, too, all of the look is found.
    let checked = taut(&["check", &etc.join("scenes/mine.toml").display().to_string()]);
    let said = String::from_utf8_lossy(&checked.stdout);
    assert!(
        checked.status.success() && !said.contains("not drawn"),
        "{said}"
    );
    // Without a library a mesh is read all the same.
    fs::remove_file(place.path("scenes/parts/part.mtl")).expect("removed");
    deployed(&place, &["--force"]);
}
