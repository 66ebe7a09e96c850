//! How bodies look: what a scene says, what their mesh files say, what is lost; and what is only seen.

use taut_scene::shapes::cuboid;
use taut_scene::{Appearance, BuiltBody, ImportRequest, import};

use crate::support::{Folder, assert_says, built};

impl Folder {
    /// What the god-object of this mesh file looks like, and what is lost.
    fn look(&self, file: &str) -> (Appearance, Vec<String>) {
        let built = self.holding(&format!("shape = {{ mesh = \"{file}\" }}"), "");
        (built.bodies[0].appearance, built.lost_looks)
    }

    /// A box as glTF: five of its sides of material 0, the last of the second of `materials`.
    fn box_gltf(&self, name: &str, materials: &str, more: &str) {
        let cube = cuboid([0.01, 0.02, 0.03]);
        let mut bytes = Vec::new();
        for index in cube.triangles.iter().flatten() {
            bytes.extend(index.to_le_bytes());
        }
        for coordinate in cube.vertices.iter().flat_map(|v| v.iter()) {
            bytes.extend((*coordinate as f32).to_le_bytes());
        }
        self.write("box.bin", &bytes);
        self.write(
            name,
            format!(
                r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[
                {{"attributes":{{"POSITION":2{more}}},"indices":0,"material":0}},{{"attributes":{{"POSITION":2}},"indices":1,"material":1}}]}}],
                "materials":[{materials}],"textures":[{{"source":0}}],"images":[{{"uri":"a.png"}}],
                "buffers":[{{"uri":"box.bin","byteLength":240}}],
                "bufferViews":[{{"buffer":0,"byteLength":120}},{{"buffer":0,"byteOffset":120,"byteLength":24}},{{"buffer":0,"byteOffset":144,"byteLength":96}}],
                "accessors":[{{"bufferView":0,"componentType":5125,"count":30,"type":"SCALAR"}},
                {{"bufferView":1,"componentType":5125,"count":6,"type":"SCALAR"}},
                {{"bufferView":2,"componentType":5126,"count":8,"type":"VEC3","min":[-1,-1,-1],"max":[1,1,1]}}]}}"#
            ),
        );
    }
}

const SPHERE: &str = "shape = { sphere = { radius = 0.01 } }\n";
const STEEL: &str = r#"{"name":"steel","pbrMetallicRoughness":{"baseColorFactor":[0.25,0.5,0.75,0.3],"roughnessFactor":0.5}}"#;
const RED: &str =
    r#"{"name":"red","pbrMetallicRoughness":{"baseColorFactor":[1,0,0,1],"metallicFactor":0}}"#;

#[test]
fn a_scene_says_how_its_bodies_look() {
    let folder = Folder::new();
    let held = format!("{SPHERE}color = \"#ff8000\"\nroughness = 0.25\nopacity = 1");
    let rest = "[[obstacle]]\nname = \"o\"\nshape = { plane = {} }\npose = { position = [0.0, 0.0, -0.1] }\n\
                color = [0.5, 0, 1]\nmetallic = 1.0\n";
    let built = folder.holding(&held, rest);
    let [held, stands] = [0, 1].map(|body| built.bodies[body].appearance);
    let [red, green, blue] = held.color.unwrap();
    assert!(
        (red, blue) == (1.0, 0.0) && (green - 0.2159).abs() < 1e-4,
        "{green}"
    );
    assert_eq!(
        (held.roughness, held.metallic, held.opacity),
        (Some(0.25), None, Some(1.0))
    );
    assert_eq!(stands.color, Some([0.5, 0.0, 1.0]));
    assert_eq!((stands.roughness, stands.metallic), (None, Some(1.0)));
    // Nothing said is nothing.
    assert_eq!(
        folder.holding(SPHERE, "").bodies[0].appearance,
        Appearance::default()
    );
}

#[test]
fn what_is_no_colour_or_no_share_is_refused_with_its_line() {
    for (held, expected) in [
        (
            "color = \"redd\"",
            "s.toml:5: `color` in [god_object] is \"redd\", but must be \"#rrggbb\", a CSS name",
        ),
        ("color = \"#12345\"", "must be \"#rrggbb\""),
        ("color = 7", "or [r, g, b] with numbers between 0 and 1"),
        (
            "color = [255, 0, 0]",
            "`color` in [god_object] is 255, but must be between 0 and 1",
        ),
        (
            "color = [0.1, 0.2]",
            "`color` in [god_object] has 2 numbers, but must have 3",
        ),
        ("color = [0.1, nan, 0.2]", "but must be between 0 and 1"),
        (
            "roughness = -0.1",
            "`roughness` in [god_object] is -0.1, but must be between 0 and 1",
        ),
        (
            "metallic = \"yes\"",
            "`metallic` in [god_object] is a text, but must be between 0 and 1",
        ),
        (
            "opacity = 1.5",
            "`opacity` in [god_object] is 1.5, but must be between 0 and 1",
        ),
        ("colour = \"#ffffff\"", "did you mean `color`?"),
    ] {
        let text = format!("name = \"x\"\n[god_object]\nmass = 1.0\n{SPHERE}{held}\n");
        let fault = Folder::new().parse(&text).expect_err(held);
        assert_says(&fault, expected);
    }
}

#[test]
fn the_material_of_a_gltf_file_is_the_bodys_where_the_scene_says_nothing() {
    let folder = Folder::new();
    folder.box_gltf("a.gltf", &format!("{STEEL},{STEEL}"), "");
    let (look, lost) = folder.look("a.gltf");
    assert_eq!(look.color, Some([0.25, 0.5, 0.75]));
    // As glTF has it: no factor is 1, and an opaque material has no opacity.
    assert_eq!(
        (look.roughness, look.metallic, look.opacity),
        (Some(0.5), Some(1.0), None)
    );
    assert_eq!(lost, [""; 0]);
    let held = "shape = { mesh = \"a.gltf\" }\ncolor = [0.0, 0.0, 0.0]\nmetallic = 0";
    let said = folder.holding(held, "").bodies[0].appearance;
    assert_eq!(
        (said.color, said.metallic, said.roughness),
        (Some([0.0; 3]), Some(0.0), Some(0.5))
    );
    let blend = STEEL.replace("{\"name\"", "{\"alphaMode\":\"BLEND\",\"name\"");
    folder.box_gltf("a.gltf", &format!("{blend},{blend}"), "");
    assert_eq!(folder.look("a.gltf").0.opacity, Some(0.3));
}

#[test]
fn triangles_look_as_their_own_materials_say() {
    let folder = Folder::new();
    folder.box_gltf("a.gltf", &format!("{STEEL},{RED}"), "");
    let looks_of = |held: &str| {
        let built = folder.holding(held, "");
        let count = |(look, count): &(Appearance, usize)| (look.color, look.roughness, *count);
        let looks: Vec<_> = built.bodies[0].looks.iter().map(count).collect();
        (looks, built.lost_looks)
    };
    let (looks, lost) = looks_of("shape = { mesh = \"a.gltf\" }");
    let steel = Some([0.25, 0.5, 0.75]);
    let counts: Vec<_> = looks.iter().map(|(_, _, count)| *count).collect();
    assert_eq!((counts, looks[0].0), (vec![10, 2], steel));
    assert_ne!(looks[1].0, steel);
    assert_eq!(lost, [""; 0]);
    // What the scene says counts for all of them.
    let (looks, _) = looks_of("shape = { mesh = \"a.gltf\" }\nroughness = 0.125");
    assert!(looks.len() == 2 && looks.iter().all(|look| look.1 == Some(0.125)));
    let (looks, _) = looks_of("shape = { mesh = \"a.gltf\" }\ncolor = \"#ffffff\"");
    assert_eq!(looks, []);
}

#[test]
fn an_imported_part_is_seen_with_the_looks_of_its_file() {
    let folder = Folder::new();
    folder.box_gltf("a.gltf", &format!("{STEEL},{RED}"), "");
    let report = import(&folder.request(&["a.gltf"])).unwrap();
    assert!(!report.to_string().contains("of its materials"), "{report}");
    let built = built(&report.scene);
    let direct = folder.holding("shape = { mesh = \"a.gltf\" }", "");
    let [seen, asked] = [&built.bodies[0], &direct.bodies[0]];
    assert_eq!(seen.mesh.triangles.len(), 12);
    let counts = |body: &BuiltBody| Vec::from_iter(body.looks.iter().map(|(_, count)| *count));
    assert_eq!(counts(seen), counts(asked));
    for ((seen, _), (asked, _)) in seen.looks.iter().zip(&asked.looks) {
        let [a, b] = [seen, asked].map(|look| look.color.unwrap());
        assert!(
            a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-4),
            "{a:?} {b:?}"
        );
        assert_eq!(
            (seen.roughness, seen.metallic),
            (asked.roughness, asked.metallic)
        );
    }
    let corners = [&seen.mesh, &asked.mesh].map(|mesh| mesh.bounds().unwrap());
    assert!(
        (corners[0].0 - corners[1].0).norm() < 1e-9 && (corners[0].1 - corners[1].1).norm() < 1e-9
    );
}

#[test]
fn a_part_that_import_turned_is_drawn_as_it_is_felt() {
    let folder = Folder::new();
    let cube = cuboid([0.01, 0.02, 0.03]);
    let mut text = String::from("mtllib a.mtl\n");
    for v in &cube.vertices {
        text += &format!("v {} {} {}\n", v.x, v.y, v.z);
    }
    for (place, [a, b, c]) in cube.triangles.iter().enumerate() {
        // Inside out: its own faces would be seen from within.
        text += &format!("usemtl m{}\nf {} {} {}\n", place % 2, a + 1, c + 1, b + 1);
    }
    folder.write("a.mtl", "newmtl m0\nKd 1 0 0\nnewmtl m1\nKd 0 1 0\n");
    folder.write("a.obj", text);
    let request = ImportRequest {
        unit: "m".parse().ok(),
        ..folder.request(&["a.obj"])
    };
    let report = import(&request).unwrap();
    assert_says(&report, "inside out");
    assert_says(&report, "of its materials");
    let scene = std::fs::read_to_string(&report.scene).unwrap();
    assert!(
        !scene.contains("visual") && scene.contains("color"),
        "{scene}"
    );
}

#[test]
fn what_is_drawn_may_be_another_form_than_what_is_felt() {
    let folder = Folder::new();
    folder.box_gltf("a.gltf", &format!("{STEEL},{RED}"), "");
    let open = "v 0 0 0\nv 0.01 0 0\nv 0 0.01 0\nf 1 2 3\n";
    folder.write("sheet.obj", open);
    let built = folder.holding(
        "shape = { sphere = { radius = 0.02 } }\nvisual = { mesh = \"a.gltf\", unit = \"cm\" }",
        "[[obstacle]]\nname = \"plate\"\nshape = { box = { half_extents = [0.1, 0.1, 0.01] } }\n\
         pose = { position = [0.0, 0.0, -0.2] }\nvisual = { mesh = \"sheet.obj\" }\ncolor = \"#ff0000\"\n",
    );
    assert!(built.world.body.primitive.is_some(), "a round ball is felt");
    let [held, plate] = [&built.bodies[0], &built.bodies[1]];
    assert_eq!((held.mesh.triangles.len(), held.looks.len()), (12, 2));
    let highest = held.mesh.vertices.iter().map(|v| v.z).fold(0.0, f64::max);
    assert!((highest - 0.03e-2).abs() < 1e-9, "{highest}");
    assert_eq!(plate.mesh.triangles.len(), 1, "an open sheet may be seen");
    assert_eq!(plate.appearance.color, Some([1.0, 0.0, 0.0]));
    assert_eq!(built.world.obstacles[0].mesh.triangles().len(), 12);
    // What cannot be read is said with its place, and what costs no collision detection is not simplified.
    for (visual, said) in [
        ("{ mesh = \"none.obj\" }", "none.obj"),
        (
            "{ mesh = \"a.gltf\", simplify = { max_error = 1e-4 } }",
            "no meaning for `visual`",
        ),
        ("{}", "names 0 forms"),
    ] {
        let text = format!("name = \"x\"\n[god_object]\nmass = 1.0\n{SPHERE}visual = {visual}\n");
        let refused = folder.build(&text).expect_err("refused");
        assert_says(&refused, said);
        assert_says(&refused, "s.toml:5");
    }
}

#[test]
fn what_a_body_cannot_show_of_its_file_is_said_once() {
    let folder = Folder::new();
    folder.box_gltf("a.gltf", &format!("{STEEL},{RED}"), ",\"COLOR_0\":2");
    let (look, lost) = folder.look("a.gltf");
    assert_eq!(look.color, Some([0.25, 0.5, 0.75]));
    assert_eq!(
        lost,
        ["of the look of \"a.gltf\" is not drawn: its colours of vertices"]
    );
    // Without its picture the factor goes on alone, unless it is white, which says nothing.
    let picture = STEEL.replace(
        "\"roughnessFactor\"",
        "\"baseColorTexture\":{\"index\":0},\"roughnessFactor\"",
    );
    folder.box_gltf("b.gltf", &format!("{picture},{picture}"), "");
    let (look, lost) = folder.look("b.gltf");
    assert_eq!(
        (look.color, look.roughness),
        (Some([0.25, 0.5, 0.75]), Some(0.5))
    );
    let why = "is not drawn: its texture \"a.png\", which cannot be opened";
    assert!(lost.len() == 1 && lost[0].contains(why), "{lost:?}");
    let white = picture.replace("[0.25,0.5,0.75,0.3]", "[1,1,1,1]");
    folder.box_gltf("c.gltf", &format!("{white},{white}"), "");
    assert_eq!(folder.look("c.gltf").0.color, None);
    // A scene that names a colour knows what it does.
    let built = folder.holding("shape = { mesh = \"b.gltf\" }\ncolor = \"#000000\"", "");
    assert_eq!(built.lost_looks, [""; 0]);
    let scene = "name = \"x\"\n[god_object]\nmass = 1.0\nshape = { mesh = \"b.gltf\" }\n";
    let report = folder.check("s.toml", scene);
    assert!(report.is_good() && report.notes == lost, "{report}");
}

const TETRAHEDRON: &str =
    "v 0 0 0\nv 0.03 0 0\nv 0 0.03 0\nv 0 0 0.03\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

#[test]
fn the_material_of_an_obj_file_is_in_the_library_beside_it() {
    let folder = Folder::new();
    folder.write(
        "a.obj",
        format!("mtllib my lib.mtl\nusemtl red paint\n{TETRAHEDRON}"),
    );
    folder.write("my lib.mtl", "newmtl red paint\nKd 1 0.5 0\nd 0.5\n");
    let (look, lost) = folder.look("a.obj");
    let [red, green, blue] = look.color.unwrap();
    assert!(
        (red, blue) == (1.0, 0.0) && (green - 0.214).abs() < 1e-3,
        "{green}"
    );
    assert_eq!((look.opacity, look.roughness), (Some(0.5), None));
    assert_eq!(lost, [""; 0]);
    for (library, expected) in [
        (
            "../my lib.mtl",
            "its materials in `../my lib.mtl`, which must lie beside it",
        ),
        ("none.mtl", "none.mtl: cannot be opened"),
    ] {
        folder.write(
            "b.obj",
            format!("mtllib {library}\nusemtl red paint\n{TETRAHEDRON}"),
        );
        let (look, lost) = folder.look("b.obj");
        assert_eq!(look, Appearance::default());
        assert!(lost.len() == 1 && lost[0].contains(expected), "{lost:?}");
    }
}

#[test]
fn materials_that_nobody_defines_and_colours_of_vertices_are_named() {
    let folder = Folder::new();
    folder.write("a.mtl", "newmtl #c0c0c0\nKd 1 1 1\n");
    let lost = |head: &str, body: &str| {
        folder.write("a.obj", format!("{head}{body}"));
        folder.look("a.obj")
    };
    let (look, said) = lost("mtllib a.mtl\nusemtl #c0c0c0\n", TETRAHEDRON);
    assert_eq!((look.color, said), (Some([1.0; 3]), Vec::new()));
    for head in ["mtllib a.mtl\nusemtl steel\n", "usemtl steel\n"] {
        let (look, said) = lost(head, TETRAHEDRON);
        assert_eq!(look, Appearance::default());
        assert_eq!(
            said,
            [
                "of the look of \"a.obj\" is not drawn: its material \"steel\", which no library defines"
            ]
        );
    }
    let coloured = TETRAHEDRON.replace("v 0.03 0 0\n", "v 0.03 0 0 1 0 0\n");
    assert_ne!(coloured, TETRAHEDRON);
    assert_eq!(
        lost("", &coloured).1,
        ["of the look of \"a.obj\" is not drawn: its colours of vertices"]
    );
}

#[test]
fn a_part_whose_library_calls_opaque_transparent_is_seen() {
    let folder = Folder::new();
    let obj = |library: &str| {
        folder.write("a.mtl", format!("newmtl m\n{library}\n"));
        folder.write("a.obj", format!("mtllib a.mtl\nusemtl m\n{TETRAHEDRON}"));
        folder.look("a.obj")
    };
    let (look, lost) = obj("Tr 1.000000");
    assert_eq!(look.opacity, Some(1.0));
    assert_eq!(
        lost,
        [
            "of the look of \"a.obj\" is not drawn: `Tr` in line 2 of a.mtl, which is 1: some programs write that of opaque parts, and so it is taken"
        ]
    );
    // What is meant to be invisible is, and says so, whatever colour the scene gives it.
    let unseen = [
        "of the look of \"a.obj\" is not drawn: all of the body: by its file it has the opacity 0",
    ];
    let (look, lost) = obj("d 0");
    assert_eq!(
        (look.opacity, lost),
        (Some(0.0), unseen.map(str::to_owned).to_vec())
    );
    let shape = "shape = { mesh = \"a.obj\" }\ncolor = \"#000000\"";
    assert_eq!(folder.holding(shape, "").lost_looks, unseen);
    let seen = folder.holding(&format!("{shape}\nopacity = 1"), "");
    assert_eq!(seen.lost_looks, [""; 0]);
}

#[test]
fn an_import_writes_the_look_of_its_parts_into_the_scene() {
    let folder = Folder::new();
    folder.box_gltf("a.gltf", &format!("{RED},{RED}"), "");
    let report = import(&folder.request(&["a.gltf"])).unwrap();
    let text = std::fs::read_to_string(&report.scene).unwrap();
    assert_says(
        &text,
        "\ncolor = \"#ff0000\"\nroughness = 1.0\nmetallic = 0.0\n",
    );
    let color = built(&report.scene).bodies[0].appearance.color;
    assert_eq!(color, Some([1.0, 0.0, 0.0]));
}

#[test]
fn scenery_is_seen_and_never_touched() {
    let folder = Folder::new();
    // An open sheet, right through the body in the hand.
    folder.write("sheet.obj", "v -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\n");
    let rest = "[[scenery]]\nname = \"sheet\"\nshape = { mesh = \"sheet.obj\", unit = \"dm\" }\n\
                color = \"#ffffff\"\npose = { position = [0.0, 0.0, 0.005] }\n";
    let built = folder.holding(SPHERE, rest);
    assert_eq!((built.bodies.len(), built.world.obstacles.len()), (1, 0));
    let sheet = &built.scenery[0];
    assert_eq!(
        (sheet.name.as_str(), sheet.mesh.triangles.len()),
        ("sheet", 1)
    );
    assert_eq!(
        (sheet.mesh.vertices[1].x, sheet.pose.translation.z),
        (0.1, 0.005)
    );
    assert_eq!(sheet.appearance.color, Some([1.0; 3]));
    let refused = |rest: &str| {
        let text = format!("name = \"x\"\n[god_object]\nmass = 1.0\n{SPHERE}{rest}");
        folder.build(&text).expect_err("a fault")
    };
    for (from, to, expected) in [
        ("name = \"sheet\"\n", "", "`name` is missing in [[scenery]]"),
        (
            "sheet.obj",
            "none.obj",
            "the file \"none.obj\" does not exist",
        ),
        (
            "unit = \"dm\"",
            "simplify = { max_error = 1e-3 }",
            "`simplify` has no meaning for [[scenery]]",
        ),
        (
            "pose =",
            "surface = {}\npose =",
            "unknown key `surface` in [[scenery]]",
        ),
    ] {
        let text = refused(&rest.replace(from, to));
        assert_says(&text, expected);
    }
    let twice = refused(&format!("{rest}{rest}"));
    assert_says(&twice, "two bodies of the name \"sheet\"");
}

#[test]
fn the_files_of_a_scene_are_those_of_its_scenery_and_of_its_light_too() {
    let folder = Folder::new();
    folder.write("seen.ply", "");
    folder.write("hall.hdr", "");
    let text = "name = \"x\"\n[god_object]\nmass = 1.0\nshape = { sphere = { radius = 0.01 } }\n\
        [[scenery]]\nname = \"s\"\nshape = { mesh = \"seen.ply\" }\n[view]\nenvironment = \"hall.hdr\"\n";
    let scene = folder.parse(text).unwrap();
    let files = scene.files().unwrap();
    let names: Vec<&str> = files.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["seen.ply", "hall.hdr"]);
    // What is no picture is named with its file when the scene is built.
    let faults = format!("{:?}", scene.build().unwrap_err().problems());
    assert_says(&faults, "cannot be read as the light");
}

#[test]
fn the_files_of_a_scene_are_those_that_its_meshes_are_read_with_too() {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("parts")).unwrap();
    folder.box_gltf("Box.GLTF", &format!("{STEEL},{STEEL}"), "");
    let libraries = "mtllib my lib.mtl\nmtllib none.mtl\nmtllib ../box.bin\n";
    folder.write("parts/a.OBJ", format!("{libraries}{TETRAHEDRON}"));
    folder.write("parts/my lib.mtl", "");
    let text = "name = \"x\"\n[god_object]\nmass = 1.0\nshape = { mesh = \"parts/a.OBJ\" }\n\
        [[scenery]]\nname = \"s\"\nshape = { mesh = \"Box.GLTF\" }\n";
    let scene = folder.parse(text).unwrap();
    let files = scene.files().unwrap();
    let names: Vec<&str> = files.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(
        names,
        ["parts/a.OBJ", "parts/my lib.mtl", "Box.GLTF", "box.bin"]
    );
    for (name, found) in &files {
        assert_eq!(*found, folder.path(name));
    }
}
