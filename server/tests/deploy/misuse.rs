//! Names with signs, places that cannot be written, secrets that others could read.

use super::*;

/// What a person may write into names goes through shell scripts and units unchanged.
#[test]
fn names_with_signs_are_words_of_the_scripts_and_units() {
    let place = prepared();
    let node = "100%i $HOME 'x' \"`y`";
    with_change(&place, |table| {
        table["node"][0]["name"] = node.into();
        table["machine"][1]["nodes"] = vec![node].into();
        let name = "a\ntouch made; `touch made`; $(touch made) \"";
        table.insert("name".to_owned(), name.into());
    });
    let said = deployed(&place, &[]);
    let folder = unpacked(&place, "left");
    let key = "render-100_i__HOME__x____y_";
    assert!(folder.join(format!("etc/{key}.key")).is_file(), "{said}");
    let unit = fs::read_to_string(folder.join(format!("units/taut-{key}.service")));
    let unit = unit.expect("a unit");
    let expected = r#"--node "100%%i $$HOME 'x' \"`y`" --stay"#;
    assert!(unit.contains(expected), "{unit}");
    for script in ["install", "uninstall"] {
        let text = fs::read_to_string(folder.join(script)).expect("a script");
        // Without root it does nothing but say so; with root nothing is run here.
        let checked = std::process::Command::new("sh")
            .arg("-n")
            .arg(folder.join(script))
            .status();
        assert!(checked.is_ok_and(|status| status.success()), "{text}");
        let mut named = text.lines().filter(|line| line.contains("touch made"));
        assert!(named.all(|line| line.starts_with('#')), "{text}");
    }
}

/// Its second line would be a setting of the unit.
#[test]
fn a_line_break_in_the_text_of_a_device_is_refused() {
    let place = prepared();
    let device = "simulated\nUser=root";
    with_change(&place, |table| {
        table["machine"][3]["device"] = device.into();
    });
    let said = refused(&place, &[]);
    let why = format!("`taut bridge`: {device:?} has a control character");
    assert!(said.contains(&why), "{said}");
    assert!(!place.path("out").exists(), "{said}");
}

#[test]
fn two_screens_of_one_machine_are_two_services_with_a_credential_each() {
    let place = prepared();
    with_change(&place, |table| {
        table["machine"][1]["nodes"] = vec!["front", "table"].into();
        let machines = table["machine"].as_array_mut().expect("machines");
        assert_eq!(machines.remove(2)["name"].as_str(), Some("right"));
    });
    deployed(&place, &[]);
    let folder = unpacked(&place, "left");
    for node in ["front", "table"] {
        let command = command(&folder, &format!("taut-render-{node}.service")).join(" ");
        assert!(command.contains(&format!("--node {node} ")), "{command}");
        assert!(command.contains(&format!("render-{node}.key")), "{command}");
        assert!(folder.join(format!("etc/render-{node}.key")).is_file());
    }
    let install = fs::read_to_string(folder.join("install")).expect("a script");
    assert!(
        install.contains("enable taut-render-front.service taut-render-table.service"),
        "{install}"
    );
}

#[test]
fn a_folder_that_cannot_be_had_is_named_and_nothing_is_half_written() {
    let place = prepared();
    let (config, key) = (place.text("workbench.toml"), place.text("cluster.key"));
    place.write("a-file", "mine");
    // A folder where the last archive should go: none is written.
    fs::create_dir_all(place.path("out/taut-device-pc.tar.gz")).expect("a folder");
    for out in ["a-file", "a-file/below", "out"] {
        let out = place.text(out);
        let output = taut(&["deploy", &config, "--master", &key, "--out", &out]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_ne!(output.status.code(), Some(0), "{said}");
        assert!(said.contains(&out), "{said}");
    }
    assert!(files(&place.path("out")).is_empty(), "half written");
    assert_eq!(fs::read(place.path("a-file")).expect("there"), b"mine");
}

#[test]
fn the_archive_of_a_machine_that_is_gone_is_named() {
    let place = prepared();
    let said = deployed(&place, &[]);
    assert!(!said.contains("remove it"), "{said}");
    with_change(&place, |table| {
        table["machine"][2]["name"] = "table-pc".into();
    });
    let said = deployed(&place, &["--force"]);
    let gone = place.text("out/taut-right.tar.gz");
    let named = said.lines().filter(|line| line.contains("remove it"));
    let named: Vec<&str> = named.collect();
    assert!(
        matches!(named[..], [line] if line.starts_with(&gone)),
        "{said}"
    );
}

/// A folder that others may look into does not open the archives to them.
#[test]
fn archives_are_readable_by_their_owner_alone() {
    let place = prepared();
    let open = fs::Permissions::from_mode(0o755);
    fs::create_dir(place.path("out")).expect("a folder");
    fs::set_permissions(place.path("out"), open).expect("its mode");
    for more in [&[][..], &["--issue", "2", "--force"]] {
        deployed(&place, more);
        let there = files(&place.path("out"));
        assert_eq!(there.len(), 4, "{there:?}");
        for file in there {
            let mode = fs::metadata(&file).expect("there").permissions().mode();
            assert_eq!(mode & 0o777, 0o600, "{}", file.display());
        }
    }
}

#[test]
fn the_operators_token_travels_with_the_server_alone() {
    let place = prepared();
    let with = |more: &str| format!("{}\n[operator]\nenabled = true\n{more}", without_operator());
    place.write("workbench.toml", &with(""));
    let said = refused(&place, &[]);
    assert!(said.contains("openssl rand"), "{said}");
    write_secret(&place, "operator.token", &"0123456789abcdef".repeat(4));
    place.write("workbench.toml", &with("token_file = \"operator.token\""));
    deployed(&place, &[]);
    let carried = unpacked(&place, "haptic-pc").join("etc/operator.token");
    let mode = fs::metadata(&carried)
        .expect("carried")
        .permissions()
        .mode();
    assert_eq!(mode & 0o777, 0o600);
    let left = files(&unpacked(&place, "left"));
    assert!(left.iter().all(|file| !file.ends_with("operator.token")));
}

/// The old key is called as `taut setup` proposed, and counts beside the new one for a while.
#[test]
fn an_old_cluster_key_is_not_written_over_the_new_one() {
    let place = prepared();
    let (old, new) = (place.path("cluster.key"), place.text("new.key"));
    assert!(taut(&["keys", "--out", &new]).status.success());
    let deployed = |also: &str| {
        with_change(&place, |table| {
            let network = table["network"].as_table_mut().expect("a table");
            network.insert("also_key".to_owned(), also.into());
            let until = "2100-01-01T00:00:00Z";
            network.insert("also_key_until".to_owned(), until.into());
        });
        let (config, out) = (place.text("workbench.toml"), place.text("out"));
        let output = taut(&["deploy", &config, "--master", &new, "--out", &out]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        (output.status.code(), said)
    };
    let (code, said) = deployed("cluster.key");
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("cluster.key"), "{said}");
    assert!(!place.path("out").exists());
    fs::rename(&old, place.path("old.key")).expect("renamed");
    let (code, said) = deployed("old.key");
    assert_eq!(code, Some(0), "{said}");
    let etc = unpacked(&place, "haptic-pc").join("etc");
    for (there, wanted) in [("cluster.key", "new.key"), ("old.key", "old.key")] {
        let carried = secret_of(&etc.join(there));
        assert_eq!(carried, secret_of(&place.path(wanted)), "{there}");
    }
}

/// The haptic PC draws nothing, so that its script knows no account that does.
#[test]
fn a_token_called_as_a_credential_of_a_screen_is_the_service_s() {
    let place = prepared();
    let name = "render-lab.token";
    let operator = format!("[operator]\nenabled = true\ntoken_file = \"{name}\"\n");
    let text = format!("{}\n{operator}", without_operator());
    place.write("workbench.toml", &text);
    write_secret(&place, name, &"0123456789abcdef".repeat(4));
    deployed(&place, &[]);
    let folder = unpacked(&place, "haptic-pc");
    let script = |name: &str| fs::read_to_string(folder.join(name)).expect("a script");
    let line = format!("install -D -m 0600 -o taut -g taut etc/{name} /etc/taut/{name}");
    let install = script("install");
    assert!(install.lines().any(|there| there == line), "{install}");
    let scripts = install + &script("uninstall");
    assert!(!scripts.contains("$account"), "{scripts}");
    // Where one draws, its credential is still that account's.
    let install = fs::read_to_string(unpacked(&place, "left").join("install"));
    let own = "-o \"$account\" etc/render-front.key";
    assert!(install.expect("a script").contains(own));
}

fn without_operator() -> String {
    let mut table: Table = workbench().parse().expect("a workbench");
    table.remove("operator");
    table.to_string()
}
