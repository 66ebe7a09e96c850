//! `taut preview`: a picture of a scene without a server. The work is `taut_render::preview`.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use god_object::Primitive;
use nalgebra::UnitQuaternion;
use taut_render::RenderError;
use taut_render::preview::{Preview, PreviewScene};
use taut_render::renderer::{Gpu, GpuChoice};
use taut_scene::{BuiltScene, FinishedFile, Scene};

use crate::cli::{PREVIEW_SIZE, PreviewArgs};
use crate::session::setup::content::{bodies, textures};
use crate::shared::failure::{EXIT_BAD_INPUT, Failure};

/// Pictures of a film that does not say how many: 10 degrees from one to the next.
const FILM_VIEWS: u32 = 36;
/// Name of the picture beside an imported scene.
const PICTURE_FILE: &str = "picture.png";

/// Draws what the command line asks for; the files written.
pub(super) fn run(args: &PreviewArgs) -> Result<Vec<String>, Failure> {
    let paths: Vec<PathBuf> = match args.orbit {
        Some(views) if args.film.is_none() => {
            (1..=views).map(|n| numbered(&args.out, n, views)).collect()
        }
        _ => vec![args.out.clone()],
    };
    check_place(&args.out)?;
    let choice = GpuChoice::of(args.gpu.as_deref());
    let size = args.size.unwrap_or(PREVIEW_SIZE);
    let usual = args.film.map_or(1, |_| FILM_VIEWS);
    let preview = preview(&args.scene, &choice, size, args.orbit.unwrap_or(usual))?;
    let files = inputs(&args.scene)?;
    let inputs: Vec<&Path> = files.iter().map(PathBuf::as_path).collect();
    let mut written = Vec::new();
    for (view, path) in (0..).zip(&paths) {
        let bytes = match args.film {
            Some(seconds) => preview.film(seconds),
            None => preview.png(view),
        };
        write(path, &bytes.map_err(failure)?, &inputs)?;
        written.push(path.display().to_string());
    }
    Ok(written)
}

/// Draws the scene of an import beside it; the reason where that cannot be.
pub(super) fn beside(scene: &str) -> Result<String, String> {
    let path = Path::new(scene).with_file_name(PICTURE_FILE);
    preview(scene, &GpuChoice::default(), PREVIEW_SIZE, 1)
        .and_then(|preview| preview.png(0).map_err(failure))
        .and_then(|bytes| write(&path, &bytes, &[]))
        .map_err(|error| error.to_string())?;
    Ok(path.display().to_string())
}

/// `turn.png` of 36 becomes `turn-01.png` to `turn-36.png`.
fn numbered(path: &Path, number: u32, of: u32) -> PathBuf {
    let width = of.to_string().len();
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{stem}-{number:0width$}.png"))
}

/// Said before anything is drawn.
fn check_place(path: &Path) -> Result<(), Failure> {
    let folder = match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    if folder.is_dir() {
        return Ok(());
    }
    Err(Failure::bad_input(format!(
        "{}: there is no folder {}; make it, or name another one with --out",
        path.display(),
        folder.display()
    )))
}

/// The scene of this name or file, ready to be drawn.
fn preview(
    scene: &str,
    choice: &GpuChoice,
    size: (u32, u32),
    views: u32,
) -> Result<Preview, Failure> {
    let built = Scene::named_or_file(scene)?.build()?;
    let gpu = Gpu::open_with(choice).map_err(failure)?;
    Preview::new(gpu, &described(&built)?, size, views).map_err(failure)
}

/// The scene file, and the files that it names.
fn inputs(scene: &str) -> Result<Vec<PathBuf>, Failure> {
    let files = Scene::named_or_file(scene)?.files()?;
    let named = files.into_iter().map(|(_, found)| found);
    // A shipped scene's name may be that of a folder here, which is not read.
    let own = Some(PathBuf::from(scene)).filter(|path| path.is_file());
    Ok(own.into_iter().chain(named).collect())
}

fn described(built: &BuiltScene) -> Result<PreviewScene, Failure> {
    let bodies = bodies(built).map(|body| body.map(|(body, mesh)| (body, Arc::new(mesh))));
    // The god-object is the first; in the hand a plane is a plate, as in scenery.
    let obstacles = (1..).zip(&built.world.obstacles);
    let endless = obstacles
        .filter(|(_, o)| matches!(o.primitive, Some(Primitive::Plane { .. })))
        .map(|(place, _)| place);
    Ok(PreviewScene {
        name: built.name.clone(),
        bodies: bodies.collect::<Result<_, _>>()?,
        textures: textures(built),
        endless: endless.collect(),
        environment: built.environment.clone().map(Arc::new),
        upright: built.view.rotation.unwrap_or_else(UnitQuaternion::identity),
    })
}

pub(super) fn failure(error: RenderError) -> Failure {
    if error.exit_code() == EXIT_BAD_INPUT {
        Failure::bad_input(error)
    } else {
        Failure::failed(error)
    }
}

/// The whole file, or none; it replaces none of the `inputs`.
pub(super) fn write(path: &Path, bytes: &[u8], inputs: &[&Path]) -> Result<(), Failure> {
    let written = FinishedFile::create(path, inputs).and_then(|mut file| {
        file.write_all(bytes)?;
        file.finish()
    });
    written.map_err(|error| {
        Failure::failed(format!(
            "{} cannot be written ({error}); name a folder that can be written with --out",
            path.display()
        ))
    })
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    /// A box of one material as glTF.
    fn write_box(folder: &Path, material: &str) {
        let cube = taut_scene::shapes::cuboid([0.02, 0.02, 0.02]);
        let mut bytes = Vec::new();
        for index in cube.triangles.iter().flatten() {
            bytes.extend(index.to_le_bytes());
        }
        for coordinate in cube.vertices.iter().flat_map(|v| v.iter()) {
            bytes.extend((*coordinate as f32).to_le_bytes());
        }
        let text = format!(
            r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":1}},"indices":0,"material":0}}]}}],"materials":[{material}],
            "buffers":[{{"uri":"box.bin","byteLength":240}}],
            "bufferViews":[{{"buffer":0,"byteLength":144}},{{"buffer":0,"byteOffset":144,"byteLength":96}}],
            "accessors":[{{"bufferView":0,"componentType":5125,"count":36,"type":"SCALAR"}},
            {{"bufferView":1,"componentType":5126,"count":8,"type":"VEC3","min":[-1,-1,-1],"max":[1,1,1]}}]}}"#
        );
        let written = fs::write(folder.join("box.bin"), bytes);
        assert!(
            written
                .and_then(|()| fs::write(folder.join("box.gltf"), text))
                .is_ok()
        );
    }

    /// The picture of the scene of this text; `None`, said aloud, without an adapter.
    fn drawn(path: &Path, text: &str) -> Option<image::RgbaImage> {
        fs::write(path, text).expect("written");
        let scene = path.display().to_string();
        match preview(&scene, &GpuChoice::default(), (320, 240), 1) {
            Ok(preview) => Some(preview.picture(0).expect("not drawn")),
            Err(Failure::BadInput(error)) => panic!("{error}"),
            Err(error) => {
                taut_test_kit::left_out(error);
                None
            }
        }
    }

    /// Numbers of red, green and blue pixels of a picture of a scene with this after `[god_object]`; `None`, said aloud, without an adapter.
    fn counts(folder: &Path, rest: &str) -> Option<[usize; 3]> {
        let text = format!("name = \"x\"\n[god_object]\nmass = 1.0\n{rest}");
        let picture = drawn(&folder.join("scene.toml"), &text)?;
        let strong = |pixel: &[u8; 4], part: usize| {
            let others = (0..3)
                .filter(|other| *other != part)
                .map(|other| pixel[other]);
            let most = others.max().unwrap_or(0);
            pixel[part] > 40 && u16::from(pixel[part]) > 2 * u16::from(most)
        };
        let count = |part| {
            picture
                .pixels()
                .filter(|pixel| strong(&pixel.0, part))
                .count()
        };
        Some([0, 1, 2].map(count))
    }

    #[test]
    fn the_colour_of_a_gltf_material_reaches_the_pixels_unless_the_scene_says_another() {
        let folder = tempfile::tempdir().expect("no temporary directory");
        let green = r#"{"pbrMetallicRoughness":{"baseColorFactor":[0.02,0.6,0.02,1],"metallicFactor":0,"roughnessFactor":0.6}}"#;
        write_box(folder.path(), green);
        let shape = "shape = { mesh = \"box.gltf\" }\n";
        let Some([red, green, blue]) = counts(folder.path(), shape) else {
            return;
        };
        assert!(green > 10_000 && red + blue == 0, "{red} {green} {blue}");
        let said = format!("{shape}color = \"#ff1010\"\n");
        let [red, green, blue] = counts(folder.path(), &said).expect("there was an adapter");
        assert!(red > 10_000 && green + blue == 0, "{red} {green} {blue}");
    }

    /// A board of 4 x 4 squares of red, green, blue and yellow that looks like none of its mirrored and turned ones.
    fn of_square(column: u32, row: u32) -> usize {
        ((column + row * row + 3 * (column / 2) * row) % 4) as usize
    }

    fn write_board(path: &Path) {
        let colours = [[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 0]];
        let board = image::RgbImage::from_fn(64, 64, |x, y| {
            image::Rgb(colours[of_square(x / 16, y / 16)])
        });
        board.save(path).expect("written");
    }

    /// A square of 0.2 m with the board on it that looks to the front, as OBJ and as glTF with its picture beside it.
    fn write_squares(folder: &Path) {
        let obj = "mtllib square.mtl\nusemtl m\nv -0.1 0 -0.1\nv 0.1 0 -0.1\nv 0.1 0 0.1\nv -0.1 0 0.1\n\
            vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";
        let mut bytes = Vec::new();
        for number in [
            -0.1, 0.0, -0.1, 0.1, 0.0, -0.1, 0.1, 0.0, 0.1, -0.1, 0.0, 0.1_f32,
        ] {
            bytes.extend(number.to_le_bytes());
        }
        // v runs down.
        for number in [0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0_f32] {
            bytes.extend(number.to_le_bytes());
        }
        for index in [0_u16, 1, 2, 0, 2, 3] {
            bytes.extend(index.to_le_bytes());
        }
        let gltf = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
            "meshes":[{"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":1},"indices":2,"material":0}]}],
            "materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0},"metallicFactor":0}}],
            "textures":[{"source":0}],"images":[{"uri":"board.png"}],
            "buffers":[{"uri":"square.bin","byteLength":92}],
            "bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":32},{"buffer":0,"byteOffset":80,"byteLength":12}],
            "accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[-1,-1,-1],"max":[1,1,1]},
            {"bufferView":1,"componentType":5126,"count":4,"type":"VEC2"},{"bufferView":2,"componentType":5123,"count":6,"type":"SCALAR"}]}"#;
        for (name, content) in [
            ("square.obj", obj.as_bytes()),
            ("square.mtl", b"newmtl m\nmap_Kd board.png\n"),
            ("square.bin", &bytes),
            ("square.gltf", gltf.as_bytes()),
        ] {
            fs::write(folder.join(name), content).expect("written");
        }
        write_board(&folder.join("board.png"));
    }

    /// The picture of a scene of one body that shows its front to the eye, upright; `None`, said aloud, without an adapter.
    fn from_the_front(path: &Path, body: &str) -> Option<image::RgbaImage> {
        // The axes of the preview's eye: 0.611 rad to the right of the front, 0.489 rad up.
        let turn = UnitQuaternion::from_scaled_axis(nalgebra::Vector3::z() * 0.611)
            * UnitQuaternion::from_scaled_axis(-nalgebra::Vector3::x() * 0.489);
        let [x, y, z] = turn.imag().into();
        let text = format!(
            "name = \"x\"\n[god_object]\nmass = 1.0\n{body}\n[view]\nrotation = [{}, {x}, {y}, {z}]\n",
            turn.w
        );
        drawn(path, &text)
    }

    /// All squares are where they are on the board, whose side takes 0.9 of the picture's height.
    fn assert_board(image: &image::RgbaImage, which: &str) {
        for (column, row) in (0..16).map(|place| (place % 4, place / 4)) {
            let from_middle = |at: u32| (at as f32 - 1.5) / 4.0 * 0.9 * 240.0;
            let (x, y) = (160.0 + from_middle(column), 120.0 + from_middle(row));
            let [red, green, blue, _] = image.get_pixel(x as u32, y as u32).0;
            let strong = [red > 50, green > 50, blue > 50];
            let expected = [
                [true, false, false],
                [false, true, false],
                [false, false, true],
                [true, true, false],
            ][of_square(column, row)];
            assert_eq!(
                strong, expected,
                "{which}: {column} {row}: {red} {green} {blue}"
            );
        }
    }

    #[test]
    fn a_board_on_a_square_reaches_the_pixels_the_right_way_up() {
        let folder = tempfile::tempdir().expect("no temporary directory");
        write_squares(folder.path());
        for file in ["square.obj", "square.gltf"] {
            let body = format!(
                "shape = {{ sphere = {{ radius = 0.01 }} }}\nvisual = {{ mesh = \"{file}\" }}"
            );
            let Some(image) = from_the_front(&folder.path().join("scene.toml"), &body) else {
                return;
            };
            assert_board(&image, file);
        }
    }

    /// The square with a back, as thick as wide and without a picture there, by way of an import that simplifies what is felt.
    #[test]
    fn an_imported_part_shows_its_picture_whatever_is_felt_of_it() {
        let folder = tempfile::tempdir().expect("no temporary directory");
        write_squares(folder.path());
        let mut part = fs::read_to_string(folder.path().join("square.obj")).expect("read");
        part += "usemtl plain\nv -0.1 0.01 -0.1\nv 0.1 0.01 -0.1\nv 0.1 0.01 0.1\nv -0.1 0.01 0.1\n\
            f 8 7 6 5\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n";
        fs::write(folder.path().join("part.obj"), part).expect("written");
        let made = folder.path().join("made");
        let report = taut_scene::import(&taut_scene::ImportRequest {
            parts: vec![folder.path().join("part.obj").into()],
            folder: made.clone(),
            unit: "m".parse().ok(),
            simplify: Some(1e-4),
            ..Default::default()
        });
        let report = report.expect("imported").to_string();
        assert!(!report.contains("its texture"), "{report}");
        assert!(made.join("part-visual-1.png").is_file());
        let body = "shape = { mesh = \"part.ply\" }\nvisual = { mesh = \"part-visual.obj\" }\n\
            pose = { position = [0.0, -0.005, 0.0], rotation = [1.0, 0.0, 0.0, 0.0] }";
        let Some(image) = from_the_front(&made.join("front.toml"), body) else {
            return;
        };
        assert_board(&image, &report);
    }

    #[test]
    fn scenery_is_drawn_and_so_is_what_stands_in_its_own_colour() {
        let folder = tempfile::tempdir().expect("no temporary directory");
        let rest = "shape = { sphere = { radius = 0.01 } }\ncolor = [0.8, 0.02, 0.02]\n\
            [[obstacle]]\nname = \"o\"\nshape = { box = { half_extents = [0.01, 0.01, 0.01] } }\n\
            pose = { position = [0.05, 0.0, 0.0] }\ncolor = [0.02, 0.6, 0.02]\n\
            [[scenery]]\nname = \"s\"\nshape = { sphere = { radius = 0.012 } }\n\
            pose = { position = [0.025, 0.0, 0.0] }\ncolor = [0.02, 0.02, 0.8]\n";
        let Some([red, green, blue]) = counts(folder.path(), rest) else {
            return;
        };
        assert!(
            red > 500 && green > 500 && blue > 500,
            "{red} {green} {blue}"
        );
    }

    #[test]
    fn a_picture_replaces_no_file_that_its_scene_names() {
        let folder = tempfile::tempdir().expect("no temporary directory");
        let path = |name: &str| folder.path().join(name);
        let text = "name = \"x\"\n[god_object]\nmass = 1.0\nshape = { sphere = { radius = 0.01 } }\n\
            [[obstacle]]\nname = \"o\"\nshape = { box = { half_extents = [0.01, 0.01, 0.01] } }\n\
            surface = { texture = { height_map = { file = \"a.png\", tile = 0.05, amplitude = 2e-4 } } }\n";
        assert!(fs::write(path("a.png"), "precious").is_ok());
        assert!(fs::write(path("scene.png"), text).is_ok());
        let files = inputs(&path("scene.png").display().to_string()).expect("it is a scene");
        let inputs: Vec<&Path> = files.iter().map(PathBuf::as_path).collect();
        for name in ["a.png", "scene.png"] {
            let refused = write(&path(name), b"picture", &inputs);
            let said = refused.expect_err("it is read").to_string();
            assert!(said.contains("it is read for this answer"), "{said}");
        }
        assert!(fs::read(path("a.png")).is_ok_and(|bytes| bytes == b"precious"));
        assert!(write(&path("b.png"), b"picture", &inputs).is_ok());
    }

    #[test]
    fn pictures_of_a_turn_sort_by_their_names() {
        let named = |n, of| numbered(Path::new("a/turn.v2.png"), n, of);
        assert_eq!(named(1, 9), Path::new("a/turn.v2-1.png"));
        assert_eq!(named(7, 120), Path::new("a/turn.v2-007.png"));
    }
}
