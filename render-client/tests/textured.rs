//! Pictures on surfaces, seen where they lie: a square in the plane of the screen takes the same pixels for every eye.
//! Left out, said aloud, without a graphics adapter.

use std::sync::Arc;

use image::{Rgba, RgbaImage};
use nalgebra::{Isometry3, Point3, Similarity3};
use taut_proto::scene::{Show, Stereo};
use taut_proto::{Finish, Look, Looks, Texture, Wrap};
use taut_render::comfort::Comfort;
use taut_render::environment::Environment;
use taut_render::stage::{Stage, StageBody, StageScreen, TriangleMesh};
use taut_render::textures::{MeshTextures, SizedTexture};
use taut_render::view::{ClipPlanes, Screen};

use crate::support::{canvas, draw, pictures, state};

const PIXELS: u32 = 200;
/// Half the side of the screen and of the square, m.
const SCREEN: f32 = 0.5;
const SQUARE: f32 = 0.4;

const COLOURS: [[u8; 4]; 4] = [
    [255, 0, 0, 255],
    [0, 255, 0, 255],
    [0, 0, 255, 255],
    [255, 255, 0, 255],
];

/// A colour for each of 4 x 4 squares that tells its place from that of all mirrored and turned boards.
fn of_square(column: u32, row: u32) -> usize {
    ((column + row * row + 3 * (column / 2) * row) % 4) as usize
}

fn board(size: u32) -> Texture {
    texture(size, |x, y| COLOURS[of_square(4 * x / size, 4 * y / size)])
}

fn texture(size: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> Texture {
    let texels = (0..size * size).map(|place| texel(place % size, place / size));
    Texture::new((size, size), texels.collect()).expect("a texture")
}

fn look(colour: [f32; 3]) -> Look {
    Look {
        colour,
        finish: Finish {
            roughness: 1.0,
            metallic: 0.0,
        },
    }
}

/// The square, seen from the front, `behind` the screen's plane, of triangles below and above its diagonal, each with its look.
fn square(behind: f32, looks: [Look; 2]) -> TriangleMesh {
    let corner = |x: f32, z: f32| [x * SQUARE, behind, z * SQUARE];
    TriangleMesh {
        vertices: vec![
            corner(-1.0, -1.0),
            corner(1.0, -1.0),
            corner(1.0, 1.0),
            corner(-1.0, 1.0),
        ],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        looks: Some(Looks {
            list: looks.to_vec(),
            of_triangles: vec![0, 1],
        }),
        textures: None,
    }
}

/// A picture on all of it from `low` to `high` in u and v; v runs down.
fn with_textures(
    mut mesh: TriangleMesh,
    list: Vec<(Texture, [Wrap; 2])>,
    of_looks: [Option<u8>; 2],
    (low, high): (f32, f32),
) -> TriangleMesh {
    let sized = |(texture, wrap): (Texture, _)| (Arc::new(SizedTexture::of(&texture)), wrap);
    let corners = [[low, high], [high, high], [high, low], [low, low]];
    let of = |t: &[u32; 3]| t.map(|v| corners[v as usize]);
    mesh.textures = Some(Arc::new(MeshTextures {
        list: list.into_iter().map(sized).collect(),
        of_looks: of_looks.to_vec(),
        coordinates: mesh.triangles.iter().map(of).collect(),
    }));
    mesh
}

fn pictured(texture: Texture, wrap: [Wrap; 2], range: (f32, f32)) -> TriangleMesh {
    let white = square(0.0, [look([1.0; 3]); 2]);
    with_textures(white, vec![(texture, wrap)], [Some(0); 2], range)
}

/// The first of the meshes in the hand, the others stand.
fn stage(meshes: Vec<TriangleMesh>) -> Stage {
    let corner = |x: f64, z: f64| Point3::new(x, 0.0, z);
    let half = f64::from(SCREEN);
    let screen = Screen::from_corners(
        corner(-half, -half),
        corner(half, -half),
        corner(-half, half),
    );
    let body = |id, mesh| StageBody {
        id,
        mesh,
        scale: 1.0,
        origin: Point3::origin(),
        pose: Isometry3::identity(),
        colour: [0.0, 0.0, 1.0],
        opacity: 1.0,
        finish: None,
    };
    Stage {
        screens: vec![StageScreen {
            name: "front".to_owned(),
            screen: screen.expect("a screen"),
            pixels: (PIXELS, PIXELS),
            stereo: Stereo::Mono,
            correction: None,
            charts: Vec::new(),
        }],
        head: Isometry3::translation(0.1, -1.0, 0.2),
        eye_separation: 0.06,
        comfort: Comfort::default(),
        clip_planes: ClipPlanes {
            near: 0.02,
            far: 20.0,
        },
        workbench_from_scene: Similarity3::identity(),
        god_object: body(u16::MAX, 0),
        reference_point: Point3::origin(),
        obstacles: (1..meshes.len())
            .map(|mesh| body(mesh as u16 - 1, mesh))
            .collect(),
        environment: Environment::of(None),
        meshes: meshes.into_iter().map(Arc::new).collect(),
    }
}

fn drawn(meshes: Vec<TriangleMesh>) -> Option<RgbaImage> {
    Some(draw(stage(meshes), Isometry3::identity())?.remove(0))
}

/// The pixel at a place of the square: fractions from its left and from its top.
fn at(image: &RgbaImage, across: f32, down: f32) -> [u8; 4] {
    let place = |share: f32| {
        let metres = (2.0 * share - 1.0) * SQUARE;
        ((metres + SCREEN) / (2.0 * SCREEN) * image.width() as f32) as u32
    };
    image.get_pixel(place(across), place(down)).0
}

/// Which of the colours a lit pixel has.
fn colour([red, green, blue, _]: [u8; 4]) -> Option<usize> {
    let strong = [red, green, blue].map(|part| part > 60);
    let weak = [red, green, blue].map(|part| part < 40);
    match (strong, weak) {
        ([true, ..], [_, true, true]) => Some(0),
        ([_, true, _], [true, _, true]) => Some(1),
        ([.., true], [true, true, _]) => Some(2),
        ([true, true, _], [.., true]) => Some(3),
        _ => None,
    }
}

#[test]
fn a_board_on_a_square_shows_each_of_its_squares_where_it_lies() {
    for size in [8, 64, 1024] {
        let Some(image) = drawn(vec![pictured(board(size), [Wrap::Repeat; 2], (0.0, 1.0))]) else {
            return;
        };
        for (column, row) in (0..16).map(|place| (place % 4, place / 4)) {
            // In four places within the square, between the middles of the two texels that it has of the smallest picture.
            for (x, y) in [(0.45, 0.45), (0.55, 0.45), (0.45, 0.55), (0.55, 0.55)] {
                let pixel = at(&image, (column as f32 + x) / 4.0, (row as f32 + y) / 4.0);
                let expected = Some(of_square(column, row));
                assert_eq!(colour(pixel), expected, "{size}: {column} {row}: {pixel:?}");
            }
        }
        // Nothing of it is beyond the square.
        assert_eq!(colour(at(&image, -0.02, 0.5)), None);
    }
}

#[test]
fn a_picture_goes_on_beyond_its_edges_as_it_is_told() {
    // Three pictures each way; the middle one is the picture itself.
    for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
        let mesh = pictured(board(64), [wrap, Wrap::Repeat], (-1.0, 2.0));
        let Some(image) = drawn(vec![mesh]) else {
            return;
        };
        for (column, row) in (0..144).map(|place| (place % 12, place / 12)) {
            let [across, down] = [column, row].map(|at| (at as f32 + 0.5) / 12.0);
            let place = wrap.within(f64::from(3.0 * across - 1.0));
            let of_picture = ((4.0 * place) as u32).min(3);
            let expected = Some(of_square(of_picture, row % 4));
            let pixel = at(&image, across, down);
            assert_eq!(
                colour(pixel),
                expected,
                "{wrap:?}: {column} {row}: {pixel:?}"
            );
        }
    }
}

#[test]
fn a_colour_is_a_factor_on_a_picture_and_light_its_decoded_value() {
    let grey = |value: u8| texture(8, move |_, _| [value, value, 255, 255]);
    let all = [Wrap::Repeat; 2];
    let factored = square(0.0, [look([0.5, 1.0, 0.25]); 2]);
    let factored = with_textures(factored, vec![(grey(188), all)], [Some(0); 2], (0.0, 1.0));
    let Some(factored) = drawn(vec![factored]) else {
        return;
    };
    // 188 of 255 is half of the light.
    let light = taut_proto::texture::light_table()[188];
    let plain = square(0.0, [look([0.5 * light, light, 0.25]); 2]);
    let plain = drawn(vec![plain]).expect("there was an adapter");
    for (a, b) in factored.pixels().zip(plain.pixels()) {
        assert!(
            a.0.iter().zip(b.0).all(|(a, b)| a.abs_diff(b) <= 2),
            "{a:?} {b:?}"
        );
    }
}

#[test]
fn parts_of_a_body_have_their_own_pictures_and_some_have_none() {
    let one = |index: usize| texture(2, move |_, _| COLOURS[index]);
    let all = [Wrap::Repeat; 2];
    let list = || vec![(one(0), all), (one(1), all)];
    let blue = [look([1.0; 3]), look([0.0, 0.0, 0.8])];
    for (looks, of_looks, expected) in [
        ([look([1.0; 3]); 2], [Some(0), Some(1)], [0, 1]),
        ([look([1.0; 3]); 2], [Some(1), Some(0)], [1, 0]),
        (blue, [Some(1), None], [1, 2]),
    ] {
        let mesh = with_textures(square(0.0, looks), list(), of_looks, (0.0, 1.0));
        let Some(image) = drawn(vec![mesh]) else {
            return;
        };
        // Below the diagonal from the lower left, and above it.
        let found = [(0.8, 0.8), (0.2, 0.2)].map(|(x, y)| colour(at(&image, x, y)));
        assert_eq!(found, expected.map(Some));
    }
}

#[test]
fn what_is_behind_is_seen_where_a_picture_is_not() {
    let half = texture(8, |x, _| if x < 4 { [255, 0, 0, 0] } else { COLOURS[1] });
    let front = pictured(half, [Wrap::Clamp; 2], (0.0, 1.0));
    let behind = square(0.1, [look([0.8, 0.0, 0.0]); 2]);
    for meshes in [vec![front.clone(), behind.clone()], vec![behind, front]] {
        let Some(image) = drawn(meshes) else {
            return;
        };
        assert_eq!(colour(at(&image, 0.25, 0.5)), Some(0), "the one behind");
        assert_eq!(colour(at(&image, 0.75, 0.5)), Some(1));
    }
}

#[test]
fn a_picture_finer_than_the_pixels_is_its_mean() {
    let fine = texture(1024, |x, y| {
        if (x + y) % 2 == 0 {
            COLOURS[0]
        } else {
            COLOURS[2]
        }
    });
    let Some(image) = drawn(vec![pictured(fine, [Wrap::Repeat; 2], (0.0, 1.0))]) else {
        return;
    };
    let mean = texture(1, |_, _| [188, 0, 188, 255]);
    let even = drawn(vec![pictured(mean, [Wrap::Repeat; 2], (0.0, 1.0))]);
    let even = even.expect("there was an adapter");
    for place in 1..20 {
        let (x, y) = (place as f32 / 20.0, (7 * place % 20) as f32 / 20.0);
        let [a, b] = [&image, &even].map(|image| at(image, x, y));
        assert!(
            a.iter().zip(b).all(|(a, b)| a.abs_diff(b) <= 4),
            "{a:?} {b:?}"
        );
    }
}

/// A wavy square of `side` x `side` cells with the board on it.
fn waves(side: u32) -> TriangleMesh {
    let count = side + 1;
    let vertex = |place: u32| {
        let [x, z] = [place % count, place / count].map(|at| 2.0 * at as f32 / side as f32 - 1.0);
        [
            x * SQUARE,
            0.003 * (9.0 * x).sin() * (7.0 * z).cos(),
            z * SQUARE,
        ]
    };
    let cell = |place: u32| {
        let at = place / side * count + place % side;
        [
            [at, at + 1, at + 1 + count],
            [at, at + 1 + count, at + count],
        ]
    };
    let triangles: Vec<[u32; 3]> = (0..side * side).flat_map(cell).collect();
    let vertices: Vec<[f32; 3]> = (0..count * count).map(vertex).collect();
    let place = |v: u32| {
        let [x, _, z] = vertices[v as usize];
        [0.5 + 0.5 * x / SQUARE, 0.5 - 0.5 * z / SQUARE]
    };
    let coordinates = triangles.iter().map(|t| t.map(place)).collect();
    let [left, right] = [0, 1].map(|_| look([1.0; 3]));
    TriangleMesh {
        looks: Some(Looks {
            list: vec![left, right],
            // A seam down the middle: the same picture twice.
            of_triangles: triangles
                .iter()
                .map(|t| u8::from(place(t[0])[0] >= 0.5))
                .collect(),
        }),
        textures: Some(Arc::new(MeshTextures {
            list: vec![(Arc::new(SizedTexture::of(&board(256))), [Wrap::Clamp; 2]); 2],
            of_looks: vec![Some(0), Some(1)],
            coordinates,
        })),
        vertices,
        triangles,
    }
}

#[test]
fn fewer_triangles_show_the_picture_where_all_of_them_do() {
    // So few pixels, from so far, that half of one is some millimetres.
    let mut stage = stage(vec![waves(150)]);
    stage.screens[0].pixels = (80, 80);
    stage.head = Isometry3::translation(0.1, -6.0, 0.2);
    let Some(mut canvas) = canvas(stage) else {
        return;
    };
    canvas.wait_for_levels();
    let mut picture = |all: bool| {
        if all {
            canvas.draw_all_triangles();
        }
        let before = canvas.renderer().triangles_drawn();
        // Elsewhere each time, so that shadows are drawn, too.
        let here = state(Isometry3::translation(
            0.0,
            if all { 1e-6 } else { 2e-6 },
            0.0,
        ));
        let image = pictures(&mut canvas, &here, Show::default()).remove(0);
        (image, canvas.renderer().triangles_drawn() - before)
    };
    let ((few, drawn_few), (all, drawn_all)) = (picture(false), picture(true));
    // Shadows, whose texels are finer, are half of them.
    assert!(drawn_few < drawn_all * 4 / 5, "{drawn_few} of {drawn_all}");
    let differ =
        |(a, b): &(&Rgba<u8>, &Rgba<u8>)| a.0.iter().zip(b.0).any(|(a, b)| a.abs_diff(b) > 60);
    let count = few.pixels().zip(all.pixels()).filter(differ).count();
    // The edges between the board's squares are 3 lines each way of 64 pixels; a slip of half a pixel changes some of them by so much.
    assert!(count < 60, "{count} pixels");
    for (column, row) in (0..16).map(|place| (place % 4, place / 4)) {
        let middle = [column, row].map(|at| (at as f32 + 0.5) / 4.0);
        let found = colour(at(&few, middle[0], middle[1]));
        assert_eq!(found, Some(of_square(column, row)), "{column} {row}");
    }
}
