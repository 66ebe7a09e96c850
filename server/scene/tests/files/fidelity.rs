//! `fidelity = "auto"`: chosen by the scene, overridden key by key, and nothing at all without the key.

use std::path::Path;

use taut_scene::fidelity::Origin;
use taut_scene::{BuiltScene, FidelityPlan, Scene, SceneError, shapes, write_ply};

use crate::support::{Folder, assert_says, quartered};

const BODY: &str = "name = \"s\"\n[god_object]\nshape = { sphere = { radius = 0.02 } }\nmass = 1.0\npose = { position = [0.0, 0.0, 0.05] }\n";
const BALL: &str = "[[obstacle]]\nname = \"a\"\nshape = { sphere = { radius = 0.02 } }\n";
const PLANE: &str = "[[obstacle]]\nname = \"a\"\nshape = { plane = {} }\n";

fn parse(text: &str) -> Result<Scene, SceneError> {
    Scene::parse("s.toml", text, Path::new(""))
}

fn plan(text: &str) -> FidelityPlan {
    let built = parse(text).and_then(|scene| scene.build()).unwrap();
    built.fidelity.expect("a choice")
}

#[test]
fn without_the_key_nothing_changes() {
    let plain = parse(&format!("{BODY}{BALL}")).unwrap().build().unwrap();
    assert_eq!(plain.fidelity, None);
    let off = format!("fidelity = \"off\"\n{BODY}{BALL}");
    let off = parse(&off).unwrap().build().unwrap();
    assert_eq!((off.settings, off.fidelity), (plain.settings, None));
}

#[test]
fn a_curved_scene_is_updated_more_often_than_a_flat_one() {
    let flat = plan(&format!("fidelity = \"auto\"\n{BODY}{PLANE}"));
    // Rows that are made anew for each force follow a ball at any rate.
    let linear = "[method]\nimplicit_rounds = 0\n";
    let round = plan(&format!("fidelity = \"auto\"\n{BODY}{BALL}{linear}"));
    assert!(flat.update_rate_hz < round.update_rate_hz);
    assert!(flat.is_within() && round.is_within());
    assert_eq!((round.budget_j, round.time_us), (0.5, None));
    let free = plan(&format!("fidelity = \"auto\"\n{BODY}{BALL}"));
    assert!(free.is_within() && free.update_rate_hz < round.update_rate_hz);
}

#[test]
fn edges_count_where_the_hand_s_path_brings_the_body() {
    let folder = Folder::new();
    let block = "[[obstacle]]\nname = \"a\"\nshape = { box = { half_extents = [0.05, 0.05, 0.01] } }\npose = { position = [0.0, 0.0, -0.01] }\n";
    let rate = |hand: Option<f64>| {
        let path = hand.map_or(String::new(), |x| {
            let trace = format!("t,x,y,z,qw,qx,qy,qz\n0,0,0,0.02,1,0,0,0\n1,{x},0,0.02,1,0,0,0\n");
            folder.write("hand.csv", trace);
            "[hand]\npath = \"hand.csv\"\n".to_owned()
        });
        let text = format!("{BODY}{block}{path}[fidelity]\nspeed = 0.1\n");
        let built = folder.build(&text).unwrap();
        built.fidelity.expect("a choice").update_rate_hz
    };
    let (beside, over, anywhere) = (rate(Some(0.02)), rate(Some(0.06)), rate(None));
    assert!(
        beside < over && beside < anywhere,
        "{beside} {over} {anywhere}"
    );
}

#[test]
fn a_plane_in_the_hand_counts_as_the_plate_that_it_is() {
    let boxed = BALL.replace(
        "sphere = { radius = 0.02 }",
        "box = { half_extents = [0.02, 0.02, 0.02] }",
    );
    for (key, obstacle) in [("fidelity = \"auto\"\n", BALL), ("", boxed.as_str())] {
        let held = |plane: &str| {
            let body = BODY.replace("sphere = { radius = 0.02 }", plane);
            let body = body.replace("0.05]", "0.5]");
            let built = parse(&format!("{key}{body}{obstacle}")).and_then(|scene| scene.build());
            let built = built.unwrap();
            (built.settings, built.fidelity)
        };
        assert_eq!(held("plane = {}"), held("plane = { size = 1.0 }"));
    }
}

#[test]
fn the_choice_reaches_the_settings_and_keys_of_the_file_win() {
    let text = format!("fidelity = \"auto\"\n{BODY}{BALL}");
    let built = parse(&text).unwrap().build().unwrap();
    let default = parse(&format!("{BODY}{BALL}")).unwrap().build().unwrap();
    assert!(built.settings.gap_tolerance > default.settings.gap_tolerance);
    let set = parse(&format!("{text}[method]\ngap_tolerance = 2e-7\n"))
        .unwrap()
        .with_override("method.implicit_rounds=2")
        .unwrap()
        .build()
        .unwrap();
    assert_eq!(
        (set.settings.gap_tolerance, set.settings.implicit_rounds),
        (2e-7, 2)
    );
    let plan = set.fidelity.expect("a choice");
    for choice in &plan.choices {
        let named = ["method.gap_tolerance", "method.implicit_rounds"];
        let expected = if named.contains(&choice.key.as_str()) {
            Origin::Set
        } else {
            Origin::Auto
        };
        assert_eq!(choice.origin, expected, "{choice:?}");
    }
    assert!(plan.to_string().contains("(set)"));
}

#[test]
fn rates_and_contacts_can_be_set_and_a_time_bounds_the_work() {
    let table = "[fidelity]\nbudget_j = 0.3\ntime_us = 150.0\nupdate_rate = 250\nbroadcast_rate = 90\ncontacts = 3\n";
    let built = parse(&format!("{BODY}{BALL}{table}"))
        .unwrap()
        .build()
        .unwrap();
    assert_eq!(built.settings.work_budget, Some(150));
    let plan = built.fidelity.expect("a choice");
    assert_eq!(
        (plan.update_rate_hz, plan.broadcast_rate_hz, plan.contacts),
        (250.0, 90.0, 3)
    );
    assert_eq!((plan.budget_j, plan.update_limit_us()), (0.3, 150.0));
}

#[test]
fn a_mesh_is_simplified_as_far_as_the_budget_allows() {
    let folder = Folder::new();
    // Far finer than anyone feels: flat parts cut into many triangles.
    let raw = quartered(shapes::cuboid([0.03, 0.03, 0.01]), 4);
    folder.write("a.ply", write_ply(&raw));
    let mesh = "[[obstacle]]\nname = \"a\"\nshape = { mesh = \"a.ply\" }\npose = { position = [0.0, 0.0, -0.01] }\n";
    let of = |head: &str| {
        let text = format!("{head}{BODY}{mesh}[coupling]\nk_h = 400.0\n");
        folder.build(&text).unwrap()
    };
    let (auto, plain) = (of("fidelity = \"auto\"\n"), of(""));
    let triangles = |built: &BuiltScene| built.bodies[1].mesh.triangles.len();
    assert_eq!(triangles(&plain), 12 * 4_usize.pow(4));
    assert!(triangles(&auto) < triangles(&plain) / 10);
    assert!(auto.simplified[0].max_error > 0.0);
    assert!(plain.simplified.is_empty());
    assert_eq!(auto.simplified.len(), 1);
    assert!(auto.simplified[0].to_original <= auto.simplified[0].max_error);
}

#[test]
fn a_budget_that_cannot_be_met_is_said() {
    let small = BODY
        .replace("0.02", "0.001")
        .replace("[god_object]", "[fidelity]\nspeed = 1.0\n[god_object]");
    let plan = plan(&format!("{small}{}", BALL.replace("0.02", "0.001")));
    assert!(!plan.is_within());
    assert_eq!(plan.update_rate_hz, 1000.0);
    assert!(plan.to_string().contains("NOT within the budget"));
}

#[test]
fn faults_name_the_line_and_the_nearest_key() {
    let table = BODY.replace("[god_object]", "[fidelity]\nbudget = 0.3\n[god_object]");
    for (text, parts) in [
        (format!("fidelity = \"best\"\n{BODY}"), ["s.toml:1", "auto"]),
        (table, ["s.toml:3", "budget_j"]),
        (
            format!("{BODY}[fidelity]\ncontacts = 9\n"),
            ["contacts", "8"],
        ),
    ] {
        let fault = parse(&(text + BALL)).expect_err("a fault");
        parts.iter().for_each(|part| assert_says(&fault, part));
    }
}

#[test]
fn check_prints_the_choice_with_its_reasons() {
    let text = format!("fidelity = \"auto\"\n{BODY}{BALL}");
    let report = Folder::new().check("s.toml", text);
    assert!(report.fidelity.is_some());
    assert_says(&report, "fidelity.update_rate");
    assert_says(&report, "between two updates");
}
