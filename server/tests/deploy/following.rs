//! A server whose service takes up edited files, and where recordings of the page may be.

use super::*;

#[test]
fn a_service_takes_up_an_edited_scene_where_deploy_is_asked_for_that() {
    let place = prepared();
    deployed(&place, &[]);
    let plain = command(&unpacked(&place, "haptic-pc"), "taut-serve.service");
    assert!(!plain.contains(&"--follow-scene".to_owned()), "{plain:?}");
    let said = refused(&place, &["--follow-scene"]);
    assert!(said.contains("--force"), "another archive: {said}");
    deployed(&place, &["--follow-scene", "--force"]);

    let folder = unpacked(&place, "haptic-pc");
    let unit = command(&folder, "taut-serve.service");
    assert_eq!(unit[..plain.len()], plain[..], "nothing else is another");
    assert_eq!(unit[plain.len()..], ["--follow-scene"]);
    let server = Running::start(&unit);
    wait_until("it serves", || server.says("serving on"));
    let scene = folder.join("etc/scenes/mine.toml");
    let text = fs::read_to_string(&scene).expect("a scene");
    let edited = text.replacen("\nname = \"", "\nname = \"edited-", 1);
    assert_ne!(edited, text);
    fs::write(&scene, edited).expect("written");
    wait_until("another session", || {
        server.text().matches("serving on").count() == 2
    });
}

#[test]
fn what_no_service_could_follow_is_refused_before_there_is_an_archive() {
    let place = prepared();
    with_change(&place, |table| {
        let monitoring = table["monitoring"].as_table_mut().expect("a table");
        monitoring.insert("enabled".to_owned(), true.into());
        monitoring.insert("record".to_owned(), "/var/lib/taut/session.rrd".into());
    });
    let said = refused(&place, &["--follow-scene"]);
    assert!(
        said.contains("--follow-scene") && said.contains("[monitoring] record"),
        "{said}"
    );
    assert!(!place.path("out").exists());
    deployed(&place, &[]); // without it all is well
}

#[test]
fn recordings_of_the_page_go_where_the_service_may_write() {
    let place = prepared();
    write_secret(&place, "operator.token", &"0123456789abcdef".repeat(2));
    for (recordings, is_good) in [
        ("recordings", false),
        ("/srv/recordings", false),
        ("/var/lib/taut/recordings", true),
    ] {
        with_change(&place, |table| {
            let operator = table["operator"].as_table_mut().expect("a table");
            operator.insert("enabled".to_owned(), true.into());
            operator.insert("token_file".to_owned(), "operator.token".into());
            operator.insert("recordings".to_owned(), recordings.into());
        });
        let (code, said) = deploy(&place, &[]);
        assert_eq!(code == Some(0), is_good, "{recordings}: {said}");
        let why = "`recordings` in [operator]";
        assert!(
            is_good || (said.contains(why) && said.contains("/var/lib/taut")),
            "{said}"
        );
    }
}
