//! A scene that is changed key by key: what comes out of the text, what stays of it, and what is refused.

use std::path::Path;

use proptest::prelude::*;
use taut_scene::Scene;

use crate::support::assert_says;

const TEXT: &str = r##"# A bench.
name = "bench"   # shown

[god_object]
shape = { sphere = { radius = 0.01 } }
mass = 1.0 # kg

[[obstacle]] # the first
name = "plate"
shape = { box = { half_extents = [0.06, 0.06, 0.005] } }
color = "#c03030" # a red
surface = { friction = 0.2, shading = { crease_angle = 0.6 } }
pose = { position = [
  0.0, # x
  0.0, # y
  -0.1, # z, below
], rotation = [1, 0, 0, 0] }

# Far away.
[[obstacle]]
name = "plate.far"
shape = { plane = {} }
[obstacle.pose]
position = [0, 0, -1] # m

[[obstacle]]
name = "lift"
shape = { plane = {} }
motion = { trace = "lift.csv" }

[[scenery]]
name = "lamp"
shape = { sphere = { radius = 0.01 } }
# The end.
"##;

fn bench() -> Scene {
    Scene::parse("bench.toml", TEXT, Path::new("")).expect("a scene")
}

fn refusal(edits: &[&str]) -> String {
    bench().edited(edits).expect_err("refused").to_string()
}

/// The lines of either text that the other does not have.
fn differences<'t>(before: &'t str, after: &'t str) -> (Vec<&'t str>, Vec<&'t str>) {
    let lacks = |a: &'t str, b: &str| {
        a.lines()
            .filter(|line| !b.lines().any(|l| l == *line))
            .collect()
    };
    (lacks(before, after), lacks(after, before))
}

#[test]
fn what_is_set_is_read_and_all_else_stays_as_it_was_written() {
    let (edited, keys) = bench()
        .edited(&[
            "plate.pose.position=[0.01, 0, -0.2]",
            "plate.color=#30c030",
            "plate.surface.friction = 0.5",
            "plate.far.surface.friction=0.7",
            "plate.far.pose.position=[0,0,-2]",
            "coupling.k_h=1500",
            "god_object.opacity=0.5",
            "lamp.color=[1.0, 0.5, 0.0]",
        ])
        .expect("taken");
    let [plate, far, _] = edited.obstacles() else {
        panic!("three obstacles")
    };
    assert_eq!(plate.pose.translation.vector.as_slice(), [0.01, 0.0, -0.2]);
    assert_eq!((plate.surface.friction, far.surface.friction), (0.5, 0.7));
    assert_eq!(far.pose.translation.vector.z, -2.0);
    assert_eq!(edited.coupling().k_h, Some(1500.0));
    // As it ran: beside a gain that is written, one that is not would be another.
    assert_eq!(edited.coupling().k_s, Some(1.0));
    assert_eq!(edited.god_object().appearance.opacity, Some(0.5));
    assert!(edited.scenery()[0].appearance.color.is_some());
    assert_eq!(keys[2].to_string(), "plate.surface.friction: 0.2 -> 0.5");
    assert_eq!(keys[3].before, None);

    let (gone, new) = differences(TEXT, edited.text());
    assert_eq!(
        gone,
        [
            "color = \"#c03030\" # a red",
            "surface = { friction = 0.2, shading = { crease_angle = 0.6 } }",
            "  0.0, # x",
            "  0.0, # y",
            "  -0.1, # z, below",
            "position = [0, 0, -1] # m",
        ]
    );
    for line in [
        "color = \"#30c030\" # a red",
        "surface = { friction = 0.5, shading = { crease_angle = 0.6 } }",
        "  0.01, # x",
        "  0, # y",
        "  -0.2, # z, below",
        "position = [0, 0, -2] # m",
        "surface = { friction = 0.7 }",
        "[coupling]",
        "k_h = 1500",
        "k_s = 1.0",
    ] {
        assert!(new.contains(&line), "{line} in {new:#?}");
    }
    // Set back, it is the same text but for what was not there.
    let back = edited
        .edited(&["plate.color=\"#c03030\""])
        .expect("taken")
        .0;
    assert!(back.text().contains("color = \"#c03030\" # a red"));
    assert_eq!(
        *bench()
            .edited::<&str>(&[])
            .expect("taken")
            .0
            .text()
            .as_ref(),
        *TEXT
    );
}

#[test]
fn what_cannot_be_taken_is_refused_by_name_and_changes_nothing() {
    for (edit, parts) in [
        (
            "plat.color=\"#fff\"",
            &["no \"plat\"", "did you mean `plate`", "lamp"][..],
        ),
        (
            "plate.surface.friction=-1",
            &["plate.surface.friction=-1", "is -1", "not below zero"],
        ),
        ("plate.surface.friction=nan", &["NaN", "finite"]),
        ("plate.pose.position=[0,0,inf]", &["inf", "finite"]),
        ("plate.far.pose.position=[0,0]", &["has 2 numbers"]),
        ("plate.pose.rotation=[2,0,0,0]", &["rotation"]),
        ("plate.color=redd", &["color"]),
        (
            "plate.shape.box.half_extents=[1,1,1]",
            &["no key that can be changed", "pose.position"],
        ),
        (
            "plate.shape.mesh=/etc/passwd",
            &["no key that can be changed"],
        ),
        ("plate.name=x", &["no key that can be changed"]),
        ("limits.force=1000", &["no \"limits\""]),
        (
            "coupling.passive=false",
            &["no key that can be changed", "k_h"],
        ),
        ("coupling.k_s=1.5", &["k_s", "at most 1"]),
        ("lamp.surface.friction=1", &["no key that can be changed"]),
        ("lift.pose.position=[0,0,1]", &["moves as its trace says"]),
        ("plate.colour=\"#ffffff\"", &["did you mean `color`"]),
        ("plate", &["has no `=`"]),
        ("=1", &["names no object"]),
        (
            "plate.color=\"#ffffff\"\n[limits]\nforce = 1",
            &["more than one line"],
        ),
    ] {
        let said = refusal(&[edit]);
        assert!(
            parts.iter().all(|part| said.contains(part)),
            "{edit}: {said}"
        );
    }
    // One of several: none.
    let said = refusal(&["coupling.k_h=10", "plate.opacity=2"]);
    assert!(
        said.contains("opacity") && said.contains("bench.toml:"),
        "{said}"
    );
    assert!(refusal(&["coupling.k_h=10"; 101]).contains("more than 100"));
    let long = format!("plate.color=\"{}\"", "x".repeat(600));
    assert!(refusal(&[&long]).contains("more than 500 bytes"));
    // A comment within what is replaced by something of another form would go.
    let text = TEXT.replace("color = \"#c03030\"", "color = [0.5, # red\n 0, 0]");
    let scene = Scene::parse("bench.toml", &text, Path::new("")).expect("a scene");
    let said = scene
        .edited(&["plate.color=\"#ffffff\""])
        .expect_err("refused");
    assert_says(&said, "would lose");
}

#[test]
fn names_that_no_edit_could_say_are_refused_with_their_line() {
    let named = |name: &str| TEXT.replace("name = \"lamp\"", &format!("name = \"{name}\""));
    for (name, why) in [
        (
            "god_object",
            "\"god_object\" in [[scenery]] is that of the held body",
        ),
        ("god-object", "is that of the held body"),
        ("coupling", "is that of the held body or of a table"),
        ("a=b", "has an `=`"),
        ("a\\tb", "a control character"),
        (" a", "a blank at its ends"),
    ] {
        let error = Scene::parse("bench.toml", &named(name), Path::new("")).expect_err("refused");
        let said = error.to_string();
        let line = TEXT
            .lines()
            .position(|line| line.contains("lamp"))
            .expect("a line")
            + 1;
        assert!(
            said.starts_with(&format!("bench.toml:{line}: the name ")) && said.contains(why),
            "{said}"
        );
    }
    let scene = Scene::parse("bench.toml", &named("a.b ü"), Path::new("")).expect("a scene");
    assert!(scene.edited(&["a.b ü.opacity=0.5"]).is_ok());
}

#[test]
fn lines_end_as_they_did_and_lists_in_one_line_are_reached() {
    let text = "name = \"a\"\r\ngod_object = { shape = { sphere = { radius = 0.01 } }, mass = 1 } # held\r\nobstacle = [{ name = \"b\", shape = { plane = {} } }]\r\n";
    let scene = Scene::parse("a.toml", text, Path::new("")).expect("a scene");
    let (edited, _) = scene
        .edited(&["b.surface.friction=1", "god_object.color=\"#000000\""])
        .expect("taken");
    assert_eq!(edited.obstacles()[0].surface.friction, 1.0);
    assert!(
        edited
            .text()
            .contains("mass = 1, color = \"#000000\" } # held\r\n"),
        "{:?}",
        edited.text()
    );
    assert!(
        edited
            .text()
            .contains("plane = {} }, surface = { friction = 1 } }]")
    );
    assert!(edited.text().contains("# held\r\n"), "{:?}", edited.text());
    assert_eq!(edited.text().matches('\n').count(), 3);
    assert_eq!(edited.text().matches("\r\n").count(), 3);
}

proptest! {
    /// Whatever is asked, it is a scene that comes out or a sentence, and what no edit can name stays.
    #[test]
    fn no_edit_breaks_it(
        name in "(plate|plate\\.far|lamp|lift|coupling|god_object|limits|[a-z.]{0,6})",
        key in "(pose\\.position|color|surface\\.friction|surface|k_h|k_s|shape|[a-z._\"\\[\\]]{0,8})",
        value in "([0-9.e+-]{0,6}|\\[[0-9., -]{0,12}\\]|\"[^\"]{0,6}\"|.{0,12})",
    ) {
        let path = format!("{name}.{key}");
        if let Ok((edited, keys)) = bench().edited(&[format!("{path}={value}")]) {
            let keys: Vec<_> = keys.iter().map(|edit| &*edit.key).collect();
            // A scene without gains that gets one gets the other too, as it ran.
            let expected = match &*path {
                "coupling.k_h" => vec![&*path, "coupling.k_s"],
                "coupling.k_s" => vec![&*path, "coupling.k_h"],
                _ => vec![&*path],
            };
            prop_assert_eq!(keys, expected);
            let read = Scene::parse("bench.toml", edited.text(), Path::new("")).expect("what was taken is a scene");
            let before = bench();
            prop_assert_eq!(read.limits(), before.limits());
            prop_assert_eq!(&read.god_object().shape, &before.god_object().shape);
            let comments = |text: &str| text.matches(" # ").count();
            prop_assert!(comments(edited.text()) >= comments(TEXT));
        }
    }
}
