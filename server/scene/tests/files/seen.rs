//! What is only seen: hands, boards, what is carried about, and parts of bodies of another opacity.

use god_object::Pose;
use nalgebra::{Point3, Vector3};
use taut_scene::{BuiltScene, Carrier, ImportRequest, import};

use crate::support::{Folder, assert_says};

const HELD: &str = "name = \"x\"\n[god_object]\nmass = 1.0\n";
const BALL: &str = "shape = { sphere = { radius = 0.01 } }\n";

fn built(text: &str) -> BuiltScene {
    Folder::new().build(text).unwrap()
}

#[test]
fn a_hand_goes_where_the_body_or_the_device_goes() {
    let text = format!(
        "{HELD}{BALL}pose = {{ position = [0.0, 0.0, 0.5] }}\n\
         [[obstacle]]\nname = \"plate\"\nshape = {{ plane = {{}} }}\n\
         [[scenery]]\nname = \"room\"\nshape = {{ box = {{ half_extents = [1.0, 1.0, 1.0] }} }}\n\
         [[scenery]]\nname = \"hand\"\nshape = {{ hand = {{ length = 0.1 }} }}\ncarried_by = \"god-object\"\n\
         pose = {{ position = [0.0, 0.0, 0.01] }}\n\
         [[scenery]]\nname = \"other\"\nshape = {{ hand = {{ side = \"left\" }} }}\ncarried_by = \"device\"\n"
    );
    let scene = built(&text);
    let carried: Vec<_> = scene.carried.iter().map(|it| (it.place, it.by)).collect();
    assert_eq!(carried, [(1, Carrier::GodObject), (2, Carrier::Device)]);
    let pose = Pose::translation(0.0, 0.0, 0.01);
    assert_eq!(scene.carried[0].pose, pose);
    assert_eq!(scene.scenery[1].pose, Pose::translation(0.0, 0.0, 0.51));
    // Skin and cuff; a colour is that of all of it.
    assert_eq!(scene.scenery[1].looks.len(), 2);
    let grey = text.replace("[0.0, 0.0, 0.01] }", "[0.0, 0.0, 0.01] }\ncolor = \"grey\"");
    assert_eq!(built(&grey).scenery[1].looks, []);
    // Its arm comes from -y, above.
    let (low, high) = scene.scenery[1].mesh.bounds().unwrap();
    assert!(
        -low.y > 2.0 * high.y && high.z > -2.0 * low.z,
        "{low} {high}"
    );
}

#[test]
fn a_board_has_its_text_on_its_front_in_any_colour() {
    let board = |more: &str| {
        let text = format!(
            "{HELD}{BALL}[[scenery]]\nname = \"board\"\n\
             shape = {{ board = {{ title = \"Übung\", text = \"one\\ntwo\", width = 0.2 }} }}\n{more}\n"
        );
        built(&text).scenery.remove(0)
    };
    let (plain, red) = (board(""), board("color = [0.5, 0.0, 0.0]"));
    for board in [&plain, &red] {
        let counts: Vec<usize> = board.looks.iter().map(|(_, count)| *count).collect();
        assert_eq!(counts, [2, 10]);
        let textures = board.textures.as_ref().expect("a text");
        assert_eq!(textures.of_looks, [Some(0), None]);
        let up = Vector3::z();
        for t in &board.mesh.triangles[..2] {
            let [a, b, c] = t.map(|v| board.mesh.vertices[v as usize]);
            let normal = (b - a).cross(&(c - a));
            assert!(normal.y < 0.0 && normal.dot(&up) == 0.0, "read from -y");
        }
    }
    assert_eq!(red.looks[0].0.color, Some([0.5, 0.0, 0.0]));
    assert_eq!(plain.textures, red.textures);
}

#[test]
fn what_is_only_seen_is_refused_where_it_would_be_felt() {
    let hand = "shape = { hand = {} }\n";
    for (text, said) in [
        (format!("{HELD}{hand}"), "are only seen"),
        (
            format!("{HELD}{BALL}[[obstacle]]\nname = \"o\"\n{hand}"),
            "are only seen",
        ),
        (
            format!("{HELD}{BALL}[[scenery]]\nname = \"o\"\n{hand}carried_by = \"hand\"\n"),
            "carried_by",
        ),
        (
            format!(
                "{HELD}{BALL}[[scenery]]\nname = \"o\"\nshape = {{ board = {{ width = 0.1 }} }}\n"
            ),
            "title",
        ),
        (
            format!(
                "{HELD}{BALL}[[scenery]]\nname = \"o\"\nshape = {{ board = {{ title = \"Ж\", width = 0.1 }} }}\n"
            ),
            "'Ж'",
        ),
        (
            format!(
                "{HELD}{BALL}[[scenery]]\nname = \"o\"\nshape = {{ board = {{ title = \"T\" }} }}\n"
            ),
            "width",
        ),
    ] {
        let error = Folder::new().parse(&text).expect_err("a fault");
        assert_says(&error, said);
    }
    // As what is drawn of a body a hand may be.
    let visual = format!("{HELD}{BALL}visual = {{ hand = {{ length = 0.1 }} }}\n");
    assert!(built(&visual).bodies[0].mesh.triangles.len() > 1000);
}

/// A pile of `count` tetrahedra side by side, each of a material of its own, with these values of `d`.
fn pile(folder: &Folder, dissolved: &[f64]) {
    let (mut obj, mut mtl) = ("mtllib pile.mtl\n".to_owned(), String::new());
    for (i, d) in dissolved.iter().enumerate() {
        let (x, first) = (0.02 * i as f64, 4 * i);
        mtl += &format!("newmtl m{i}\nKd 0.{} 0.5 0.25\nd {d}\n", i + 1);
        obj += &format!(
            "v {x} 0 0\nv {} 0 0\nv {x} 0.01 0\nv {x} 0 0.01\nusemtl m{i}\n",
            x + 0.01
        );
        for face in [[1, 3, 2], [1, 2, 4], [1, 4, 3], [2, 3, 4]] {
            let [a, b, c] = face.map(|v| first + v);
            obj += &format!("f {a} {b} {c}\n");
        }
    }
    folder.write("pile.obj", obj);
    folder.write("pile.mtl", mtl);
}

/// Opacity and corners of all that is drawn, in some order.
fn drawn(scene: &BuiltScene) -> Vec<(f32, Vec<Point3<f64>>)> {
    let bodies = scene.bodies.iter().chain(&scene.scenery);
    let of_body = |body: &taut_scene::BuiltBody| {
        let opacity = body.appearance.opacity.unwrap_or(1.0);
        let corners = body.mesh.triangles.iter();
        let corners = corners.map(|t| t.map(|v| body.pose * body.mesh.vertices[v as usize]));
        let corners: Vec<_> = corners.map(|corners| (opacity, corners.to_vec())).collect();
        corners
    };
    let mut all: Vec<_> = bodies.flat_map(of_body).collect();
    all.sort_by(|a, b| format!("{:?}", a.1).cmp(&format!("{:?}", b.1)));
    all
}

#[test]
fn parts_of_another_opacity_are_drawn_beside_their_body() {
    let folder = Folder::new();
    let held = format!("{HELD}shape = {{ mesh = \"pile.obj\" }}\n");
    for dissolved in [
        vec![1.0, 1.0, 1.0],
        vec![1.0, 0.25, 1.0],
        vec![0.25, 0.25, 1.0],
        vec![0.5, 1.0, 0.25, 0.75, 0.5],
        vec![0.0, 1.0],
    ] {
        pile(&folder, &dissolved);
        let scene = folder.build(&held).unwrap();
        let mut kinds = dissolved.clone();
        kinds.sort_by(f64::total_cmp);
        kinds.dedup();
        assert_eq!(scene.scenery.len(), kinds.len() - 1, "{dissolved:?}");
        let all = drawn(&scene);
        assert_eq!(all.len(), 4 * dissolved.len());
        for (opacity, corners) in &all {
            let number = (corners[0].x / 0.02) as usize;
            assert_eq!(f64::from(*opacity), dissolved[number], "{dissolved:?}");
        }
        // It is felt as ever, and each part has the colour of its own.
        assert_eq!(scene.world.body.mesh.triangles().len(), 4 * dissolved.len());
        let looks = scene.bodies.iter().chain(&scene.scenery);
        let looks: usize = looks.map(|body| body.looks.len()).sum();
        assert_eq!(looks, dissolved.len());
        let by = scene
            .carried
            .iter()
            .all(|it| it.by == Carrier::GodObject && it.pose == Pose::identity());
        assert!(by && scene.carried.len() == scene.scenery.len());
        // What the scene says counts for all.
        let one = folder.build(&format!("{held}opacity = 0.75\n")).unwrap();
        assert!(one.scenery.is_empty() && one.bodies[0].appearance.opacity == Some(0.75));
        // An import says the same.
        let request = ImportRequest {
            unit: "m".parse().ok(),
            ..folder.request(&["pile.obj"])
        };
        let report = import(&request).unwrap();
        let imported = crate::support::built(&report.scene);
        let report = report.to_string();
        assert!(
            !report.contains("opacity") || dissolved.contains(&0.0),
            "{report}"
        );
        let opacities = |all: &[(f32, Vec<Point3<f64>>)]| -> Vec<f32> {
            let mut all: Vec<f32> = all.iter().map(|(opacity, _)| *opacity).collect();
            all.sort_by(f32::total_cmp);
            all
        };
        assert_eq!(opacities(&drawn(&imported)), opacities(&all));
        std::fs::remove_dir_all(request.folder).unwrap();
    }
}

#[test]
fn a_body_of_many_opacities_keeps_those_of_its_largest_parts() {
    let folder = Folder::new();
    let dissolved: Vec<f64> = (1..=9).map(|i| 0.1 * f64::from(i)).collect();
    pile(&folder, &dissolved);
    let held = format!("{HELD}shape = {{ mesh = \"pile.obj\" }}\n");
    let scene = folder.build(&held).unwrap();
    assert_eq!(scene.scenery.len(), 3);
    assert_eq!(drawn(&scene).len(), 36, "nothing is lost");
}

#[test]
fn parts_of_obstacles_go_where_these_go_and_names_stay_unique() {
    let folder = Folder::new();
    pile(&folder, &[1.0, 0.5]);
    let trace = "t,x,y,z,qw,qx,qy,qz\n0,0,0,0.1,1,0,0,0\n1,0,0,0.2,1,0,0,0\n";
    folder.write("up.csv", trace);
    let text = format!(
        "{HELD}{BALL}pose = {{ position = [0.0, 0.0, 0.5] }}\n\
         [[obstacle]]\nname = \"stands\"\nshape = {{ mesh = \"pile.obj\" }}\npose = {{ position = [0.0, 0.1, 0.0] }}\n\
         [[obstacle]]\nname = \"rises\"\nshape = {{ mesh = \"pile.obj\" }}\nmotion = {{ trace = \"up.csv\" }}\n\
         [[scenery]]\nname = \"seen\"\nshape = {{ mesh = \"pile.obj\" }}\ncarried_by = \"device\"\n"
    );
    let scene = folder.build(&text).unwrap();
    let names: Vec<&str> = scene
        .scenery
        .iter()
        .map(|body| body.name.as_str())
        .collect();
    assert_eq!(names, ["seen", "seen = 2", "stands = 2", "rises = 2"]);
    let carried: Vec<_> = scene.carried.iter().map(|it| (it.place, it.by)).collect();
    let device = Carrier::Device;
    assert_eq!(
        carried,
        [(0, device), (1, device), (3, Carrier::Obstacle(1))]
    );
    assert_eq!(scene.scenery[2].pose, Pose::translation(0.0, 0.1, 0.0));
    assert_eq!(scene.scenery[3].pose, Pose::translation(0.0, 0.0, 0.1));
}
