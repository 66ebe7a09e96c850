//! Pictures on surfaces: read from glTF and OBJ files, kept by an import, said where they are lost.

use std::io::Cursor;

use image::{ImageFormat, Rgba, RgbaImage};
use taut_proto::Wrap;
use taut_scene::{BodyTextures, BuiltBody, ImportPart, ImportRequest, import};
use taut_test_kit::base64;

use crate::support::{Folder, built};

/// Red, green, blue and yellow, from the upper left on, row by row.
const COLOURS: [[u8; 4]; 4] = [
    [255, 0, 0, 255],
    [0, 255, 0, 255],
    [0, 0, 255, 255],
    [255, 255, 0, 255],
];

fn board(size: u32, alpha: u8) -> RgbaImage {
    RgbaImage::from_fn(size, size, |x, y| {
        let [r, g, b, _] = COLOURS[(2 * (2 * y / size) + 2 * x / size) as usize];
        Rgba([r, g, b, if x < size / 2 { alpha } else { 255 }])
    })
}

fn png(picture: &RgbaImage) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, ImageFormat::Png).unwrap();
    bytes.into_inner()
}

/// Where the picture of a glTF file is.
#[derive(Clone, Copy, Debug, PartialEq)]
enum At {
    Buffer,
    Uri,
    File,
}

impl Folder {
    /// A tetrahedron whose face (0, 1, 2) has the picture's upper left half; `texture` and `material` have more of their keys.
    fn gltf(&self, name: &str, at: At, picture: &[u8], texture: &str, material: &str) {
        let mut bytes = Vec::new();
        for index in [0_u16, 1, 2, 0, 3, 1, 1, 3, 2, 2, 3, 0] {
            bytes.extend(index.to_le_bytes());
        }
        for coordinate in [
            [0.0_f32, 0.0, 0.0],
            [0.0, 0.02, 0.0],
            [0.02, 0.0, 0.0],
            [0.0, 0.0, 0.02],
        ] {
            coordinate
                .iter()
                .for_each(|c| bytes.extend(c.to_le_bytes()));
        }
        for pair in [[0.0_f32, 0.0], [0.0, 1.0], [1.0, 0.0], [0.5, 0.5]] {
            pair.iter().for_each(|c| bytes.extend(c.to_le_bytes()));
        }
        let start = bytes.len();
        bytes.extend(picture);
        let image = match at {
            At::Buffer => r#"{"bufferView":3,"mimeType":"image/png"}"#.to_owned(),
            At::Uri => format!(r#"{{"uri":"data:image/png;base64,{}"}}"#, base64(picture)),
            At::File => r#"{"uri":"a%20picture.png"}"#.to_owned(),
        };
        let text = format!(
            r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":1,"TEXCOORD_1":2}},"indices":0,"material":0}}]}}],
            "materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0,"texCoord":1{texture}}},"metallicFactor":0}}{material}}}],
            "textures":[{{"source":0,"sampler":0}}],"samplers":[{{"wrapS":33648,"wrapT":33071}}],"images":[{image}],
            "buffers":[{{"uri":"data:application/octet-stream;base64,{}","byteLength":{}}}],
            "bufferViews":[{{"buffer":0,"byteLength":24}},{{"buffer":0,"byteOffset":24,"byteLength":48}},
            {{"buffer":0,"byteOffset":72,"byteLength":32}},{{"buffer":0,"byteOffset":{start},"byteLength":{}}}],
            "accessors":[{{"bufferView":0,"componentType":5123,"count":12,"type":"SCALAR"}},
            {{"bufferView":1,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,1]}},
            {{"bufferView":2,"componentType":5126,"count":4,"type":"VEC2"}}]}}"#,
            base64(&bytes),
            bytes.len(),
            picture.len(),
        );
        self.write(name, text);
    }

    fn body(&self, file: &str) -> (BuiltBody, Vec<String>) {
        let mut built = self.holding(&format!("shape = {{ mesh = \"{file}\" }}"), "");
        (built.bodies.remove(0), built.lost_looks)
    }

    fn imported(&self, part: &str) -> (BuiltBody, Vec<String>, String) {
        let report = import(&ImportRequest {
            unit: "m".parse().ok(),
            ..self.request(&[part])
        });
        let report = report.unwrap();
        let mut built = built(&report.scene);
        let said = report.to_string();
        (built.bodies.remove(0), built.lost_looks, said)
    }

    fn body_of_obj(&self) -> (BuiltBody, Vec<String>) {
        self.write("a.obj", OBJ);
        self.body("a.obj")
    }
}

fn textures(body: &BuiltBody) -> &BodyTextures {
    body.textures.as_deref().expect("textures")
}

/// The texel under the point of the face in z = 0 at x, y in 0.02 m, and its place in the picture.
fn seen(body: &BuiltBody, [x, y]: [f64; 2]) -> [u8; 4] {
    let textures = textures(body);
    let flat = |t: &[u32; 3]| t.iter().all(|v| body.mesh.vertices[*v as usize].z == 0.0);
    let face = body.mesh.triangles.iter().position(flat).expect("the face");
    let corners = body.mesh.triangles[face].map(|v| body.mesh.vertices[v as usize] * 50.0);
    let area = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| {
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    };
    let [a, b, c] = corners.map(|corner| [corner.x, corner.y]);
    let at = [x, y];
    let shares = [area(at, b, c), area(a, at, c), area(a, b, at)].map(|part| part / area(a, b, c));
    assert!(
        shares.iter().all(|share| *share >= 0.0),
        "on the face: {shares:?}"
    );
    let place = |i: usize| -> f64 {
        let pairs = textures.coordinates[face].iter();
        pairs
            .zip(shares)
            .map(|(pair, share)| f64::from(pair[i]) * share)
            .sum()
    };
    let used = &textures.list[textures.of_looks[0].expect("a texture")];
    let (width, height) = used.texture.size();
    let within = |i: usize, side: u32| (used.wrap[i].within(place(i)) * f64::from(side)) as u32;
    let (column, row) = (within(0, width), within(1, height));
    used.texture.texels()[(row.min(height - 1) * width + column.min(width - 1)) as usize]
}

/// x is along the picture's rows, y down it: the corner at the origin is red.
fn assert_laid(body: &BuiltBody) {
    for (at, colour) in [
        ([0.1, 0.1], COLOURS[0]),
        ([0.8, 0.1], COLOURS[1]),
        ([0.1, 0.8], COLOURS[2]),
    ] {
        assert_eq!(seen(body, at), colour, "{at:?}");
    }
}

#[test]
fn a_gltf_picture_is_read_from_wherever_it_is() {
    for at in [At::Buffer, At::Uri, At::File] {
        let folder = Folder::new();
        let picture = png(&board(8, 255));
        folder.write("a picture.png", &picture);
        folder.gltf("a.gltf", at, &picture, "", "");
        let (body, lost) = folder.body("a.gltf");
        assert_eq!(lost, [""; 0], "{at:?}");
        assert_laid(&body);
        assert_eq!(textures(&body).list[0].wrap, [Wrap::Mirror, Wrap::Clamp]);
        assert_eq!(body.looks[0].0.color, Some([1.0; 3]), "a factor of 1");
        // By areas of its faces and shares of the colours on each; one lies on the border between two colours.
        let mean = body.appearance.color.unwrap();
        let (all, slanted) = (1.5 + 3f32.sqrt() / 2.0, 3f32.sqrt() / 4.0);
        let exact = [0.75, 0.375 + slanted, 0.375 + slanted].map(|part| part / all);
        let near = mean.iter().zip(exact).all(|(a, b)| (a - b).abs() < 0.006);
        assert!(near, "{mean:?} and not {exact:?}");
        // What belongs to the scene is known to who watches or packs it.
        let text = "name = \"x\"\n[god_object]\nmass = 1.0\nshape = { mesh = \"a.gltf\" }\n";
        let scene = folder.parse(text).unwrap();
        let names: Vec<String> = scene.files().unwrap().into_iter().map(|(n, _)| n).collect();
        assert_eq!(names.contains(&"a picture.png".to_owned()), at == At::File);

        let (seen, lost, report) = folder.imported("a.gltf");
        assert_eq!(lost, [""; 0]);
        assert!(!report.contains("not drawn"), "{report}");
        assert_laid(&seen);
        assert_eq!(textures(&seen).list[0].wrap, [Wrap::Mirror, Wrap::Clamp]);
        let kept = std::fs::read(folder.path("out/a-visual-1.png")).unwrap();
        assert_eq!(kept, picture, "the file itself");
    }
}

#[test]
fn a_body_of_several_files_has_the_pictures_of_each() {
    let folder = Folder::new();
    folder.gltf("a.gltf", At::Uri, &png(&board(8, 255)), "", "");
    let plain = "v 1 0 0\nv 1 0.02 0\nv 1.02 0 0\nv 1 0 0.02\nf 1 2 3\nf 1 4 2\nf 2 4 3\nf 3 4 1\n";
    folder.write("b.obj", plain);
    let grey = RgbaImage::from_pixel(4, 4, Rgba([90, 90, 90, 255]));
    folder.write("c.png", png(&grey));
    folder.write(
        "a.mtl",
        "newmtl wood\nmap_Kd c.png\nnewmtl steel\nKd 1 0 0\n",
    );
    folder.write(
        "c.obj",
        OBJ.replace("v 0 0", "v 2 0").replace("v 0.02", "v 2.02"),
    );
    let of_one = |name: &str| ImportPart {
        body: Some("one".to_owned()),
        ..folder.path(name).into()
    };
    let report = import(&ImportRequest {
        parts: ["a.gltf", "b.obj", "c.obj"].map(of_one).into(),
        unit: "m".parse().ok(),
        ..folder.request(&[])
    });
    let report = report.unwrap();
    assert!(!report.to_string().contains("not drawn"));
    let built = built(&report.scene);
    assert_eq!(built.lost_looks, [""; 0]);
    let body = &built.bodies[0];
    assert_eq!(body.mesh.triangles.len(), 12);
    assert_laid(body);
    let all = textures(body);
    let counts: Vec<usize> = body.looks.iter().map(|(_, count)| *count).collect();
    assert_eq!(counts, [4, 4, 1, 3]);
    let texel = |place: usize| all.list[place].texture.texels()[0];
    let found: Vec<_> = all.of_looks.iter().map(|place| place.map(texel)).collect();
    let expected = [Some(COLOURS[0]), None, Some([90, 90, 90, 255]), None];
    assert_eq!(found, expected);
}

#[test]
fn a_gltf_transform_moves_the_picture() {
    let folder = Folder::new();
    let picture = png(&board(8, 255));
    let moved = |transform: &str| {
        let more = format!(",\"extensions\":{{\"KHR_texture_transform\":{transform}}}");
        folder.gltf("a.gltf", At::Uri, &picture, &more, "");
        folder.body("a.gltf").0
    };
    let body = moved(r#"{"offset":[0.5,0],"scale":[0.5,0.5]}"#);
    assert_eq!(
        seen(&body, [0.1, 0.1]),
        COLOURS[1],
        "the upper right quarter"
    );
    assert_eq!(seen(&body, [0.1, 0.8]), COLOURS[1]);
    // A quarter turn anticlockwise, as seen with v down: what was along u goes up.
    let body = moved(r#"{"rotation":1.5707963267948966,"offset":[0,1]}"#);
    assert_eq!(seen(&body, [0.1, 0.1]), COLOURS[2]);
    assert_eq!(seen(&body, [0.8, 0.1]), COLOURS[0]);
}

#[test]
fn opacity_counts_where_the_material_blends_or_has_holes() {
    let folder = Folder::new();
    let picture = png(&board(8, 64));
    let opacity = |material: &str| {
        folder.gltf("a.gltf", At::Uri, &picture, "", material);
        let (body, lost) = folder.body("a.gltf");
        (seen(&body, [0.1, 0.1])[3], body.appearance.opacity, lost)
    };
    assert_eq!(opacity(""), (255, None, vec![]));
    let blend = ",\"alphaMode\":\"BLEND\"";
    assert_eq!(opacity(blend), (64, Some(1.0), vec![]));
    assert_eq!(opacity(",\"alphaMode\":\"MASK\""), (64, None, vec![]));
    // An import says so in its library, which is read again.
    folder.gltf("b.gltf", At::Uri, &picture, "", blend);
    let (body, _, _) = folder.imported("b.gltf");
    assert_eq!(seen(&body, [0.1, 0.1])[3], 64);
}

/// The same tetrahedron; v runs up the picture.
const OBJ: &str = "mtllib a.mtl\nv 0 0 0\nv 0 0.02 0\nv 0.02 0 0\nv 0 0 0.02\nvt 0 1\nvt 0 0\nvt 1 1\n\
                   usemtl wood\nf 1/1 2/2 3/3\nusemtl steel\nf 1 4 2\nf 2 4 3\nf 3 4 1\n";

#[test]
fn an_obj_picture_is_read_beside_its_library_and_runs_up() {
    for (option, name) in [("", "a picture.png"), ("-s 1 1 1 -o 1 0 0 ", "sub/b.png")] {
        let folder = Folder::new();
        std::fs::create_dir(folder.path("sub")).unwrap();
        folder.write(name, png(&board(8, 255)));
        let library =
            format!("newmtl wood\nKd 0.5 0.5 0.5\nmap_Kd {option}{name}\nnewmtl steel\nKd 1 0 0\n");
        folder.write("a.mtl", library);
        let (body, lost) = folder.body_of_obj();
        assert_eq!(lost, [""; 0]);
        assert_laid(&body);
        assert_eq!(
            body.looks.iter().map(|(_, n)| *n).collect::<Vec<_>>(),
            [1, 3]
        );
        assert_eq!(textures(&body).of_looks, [Some(0), None]);
        // Kd is a factor, from sRGB.
        let [factor, ..] = body.looks[0].0.color.unwrap();
        assert!((factor - 0.214).abs() < 1e-3, "{factor}");
        let (seen, lost, _) = folder.imported("a.obj");
        assert_eq!(lost, [""; 0]);
        assert_laid(&seen);
        assert_eq!(textures(&seen).of_looks, [Some(0), None]);
        let [again, ..] = seen.looks[0].0.color.unwrap();
        assert!((again - factor).abs() < 1e-4);
    }
}

#[test]
fn a_jpeg_is_read_by_what_it_holds_and_kept_as_it_is() {
    let folder = Folder::new();
    let mut bytes = Cursor::new(Vec::new());
    let picture = image::DynamicImage::ImageRgba8(board(64, 255)).to_rgb8();
    picture.write_to(&mut bytes, ImageFormat::Jpeg).unwrap();
    folder.write("misnamed.png", bytes.get_ref());
    folder.write("a.mtl", "newmtl wood\nmap_Kd misnamed.png\n");
    let (body, _) = folder.body_of_obj();
    let [red, green, blue, _] = seen(&body, [0.1, 0.1]);
    assert!(red > 240 && green < 16 && blue < 16, "{red} {green} {blue}");
    let (again, _, _) = folder.imported("a.obj");
    assert_eq!(textures(&again).list[0].hash, textures(&body).list[0].hash);
    assert!(folder.path("out/a-visual-1.jpg").is_file());
}

#[test]
fn pictures_that_cannot_be_drawn_are_said_and_the_colour_goes_on() {
    let folder = Folder::new();
    folder.write("text.png", "no picture");
    let whole = png(&board(8, 255));
    folder.write("cut.png", &whole[..whole.len() / 2]);
    std::fs::create_dir(folder.path("in")).unwrap();
    for (name, why) in [
        ("none.png", "\"none.png\", which cannot be opened"),
        ("text.png", "which is no PNG or JPEG picture"),
        ("cut.png", "which cannot be read"),
        ("../cut.png", "which must lie beside"),
        ("/etc/passwd", "which must lie beside"),
        ("in", "which is a directory"),
    ] {
        folder.write("a.mtl", format!("newmtl wood\nKd 0 1 0\nmap_Kd {name}\n"));
        let (body, lost) = folder.body_of_obj();
        assert!(lost.len() == 1 && lost[0].contains(why), "{name}: {lost:?}");
        assert!(body.textures.is_none());
        assert_eq!(
            body.looks.first().and_then(|(look, _)| look.color),
            Some([0.0, 1.0, 0.0])
        );
    }
    // A picture on a face that has no place in it.
    folder.write("b.png", &whole);
    folder.write(
        "a.mtl",
        "newmtl wood\nmap_Kd b.png\nnewmtl steel\nmap_Kd b.png\n",
    );
    let (_, lost) = folder.body_of_obj();
    let why = "its texture \"b.png\" on 3 triangles that have no texture coordinates";
    assert!(lost.len() == 1 && lost[0].contains(why), "{lost:?}");
}

#[test]
fn where_other_triangles_are_drawn_the_mean_colour_goes_on() {
    let folder = Folder::new();
    folder.write(
        "b.png",
        png(&RgbaImage::from_pixel(4, 4, Rgba([0, 188, 0, 255]))),
    );
    folder.write(
        "a.mtl",
        "newmtl wood\nmap_Kd b.png\nnewmtl steel\nmap_Kd b.png\n",
    );
    // A quarter of a cube of 8 x 8 squares each side: it is simplified to fewer triangles.
    let mut text = String::from("mtllib a.mtl\nusemtl wood\nvt 0 0\n");
    let cube = taut_scene::shapes::sphere(0.02, 3);
    for v in &cube.vertices {
        text += &format!("v {} {} {}\n", v.x, v.y, v.z);
    }
    for [a, b, c] in cube.triangles.iter().map(|t| t.map(|v| v + 1)) {
        text += &format!("f {a}/1 {b}/1 {c}/1\n");
    }
    folder.write("c.obj", text);
    let built = folder.holding(
        "shape = { mesh = \"c.obj\", simplify = { max_error = 0.001 } }",
        "",
    );
    let body = &built.bodies[0];
    assert!(body.textures.is_none() && body.mesh.triangles.len() < cube.triangles.len());
    let [red, green, _] = body.appearance.color.unwrap();
    assert!(red == 0.0 && (green - 0.503).abs() < 2e-3, "{green}");
    assert!(
        built.lost_looks[0].contains("its textures: the triangles"),
        "{:?}",
        built.lost_looks
    );
    // As it says, the same file as what is drawn shows them; a colour of the scene counts before any picture.
    let held = "shape = { mesh = \"c.obj\", simplify = { max_error = 0.001 } }\nvisual = { mesh = \"c.obj\" }";
    let built = folder.holding(held, "");
    assert!(built.bodies[0].textures.is_some() && built.lost_looks.is_empty());
    let built = folder.holding(&format!("{held}\ncolor = \"red\""), "");
    assert!(built.bodies[0].textures.is_none() && built.lost_looks.is_empty());
}

#[test]
fn pieces_keep_their_places_in_the_picture() {
    let folder = Folder::new();
    folder.write("b.png", png(&board(8, 255)));
    folder.write(
        "a.mtl",
        "newmtl wood\nmap_Kd b.png\nnewmtl steel\nKd 1 0 0\n",
    );
    let other = "o other\nv 1 0 0\nv 1 0.02 0\nv 1.02 0 0\nv 1 0 0.02\nf 1 2 3\nf 1 4 2\nf 2 4 3\nf 3 4 1\no wanted\n";
    let (head, rest) = OBJ.split_once("v 0 0 0").unwrap();
    let rest = rest.replace("1/1 2/2 3/3", "5/1 6/2 7/3");
    let rest = rest.replace("f 1 4 2\nf 2 4 3\nf 3 4 1", "f 5 8 6\nf 6 8 7\nf 7 8 5");
    folder.write("a.obj", format!("{head}{other}v 0 0 0{rest}"));
    let built = folder.holding("shape = { mesh = \"a.obj\", only = [\"wanted\"] }", "");
    let body = &built.bodies[0];
    assert_eq!(body.mesh.triangles.len(), 4);
    assert_laid(body);
}
