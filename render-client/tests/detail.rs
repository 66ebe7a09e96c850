//! Levels of detail: what they claim of their error, and that nobody sees it. Skipped, said aloud, without an adapter where pictures are drawn.

use std::f32::consts::{PI, TAU};

use image::RgbaImage;
use nalgebra::{Isometry3, Similarity3};
use parry3d_f64::math::Vector;
use parry3d_f64::query::PointQuery;
use parry3d_f64::shape::TriMesh;
use taut_proto::scene::{Show, Stereo};
use taut_render::detail::Detail;
use taut_render::normals::{Shaded, shade};
use taut_render::renderer::shapes;
use taut_render::stage::{Stage, TriangleMesh};

use crate::perceptual::{difference, halved};
use crate::support::{canvas, peg_in_hole, pictures, state};

/// A surface over longitude and latitude, m.
fn globe(rings: u32, place: impl Fn(f32, f32) -> [f32; 3]) -> TriangleMesh {
    let around = 2 * rings;
    let index = |ring: u32, segment: u32| ring * around + segment % around;
    let mut mesh = TriangleMesh {
        vertices: Vec::new(),
        triangles: Vec::new(),
        looks: None,
        textures: None,
    };
    for ring in 0..=rings {
        let latitude = PI * (ring as f32 / rings as f32 - 0.5);
        for segment in 0..around {
            let longitude = TAU * segment as f32 / around as f32;
            mesh.vertices.push(place(longitude, latitude));
        }
    }
    for ring in 0..rings {
        for segment in 0..around {
            let [a, b] = [index(ring, segment), index(ring, segment + 1)];
            let [c, d] = [index(ring + 1, segment + 1), index(ring + 1, segment)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

fn on_sphere(longitude: f32, latitude: f32, radius: f32) -> [f32; 3] {
    let (sine, cosine) = latitude.sin_cos();
    [
        radius * cosine * longitude.cos(),
        radius * cosine * longitude.sin(),
        radius * sine,
    ]
}

/// A cube whose faces are cut into squares.
fn tiled_cube(half: f32, tiles: u32) -> TriangleMesh {
    globe(tiles, |longitude, latitude| {
        let direction = on_sphere(longitude, latitude, 1.0);
        let most = direction.iter().fold(0.0_f32, |most, x| most.max(x.abs()));
        direction.map(|x| half * x / most)
    })
}

fn beside(one: TriangleMesh, other: TriangleMesh, shift: f32) -> TriangleMesh {
    let first = one.vertices.len() as u32;
    let mut both = one;
    both.vertices
        .extend(other.vertices.iter().map(|[x, y, z]| [x + shift, *y, *z]));
    both.triangles
        .extend(other.triangles.iter().map(|t| t.map(|v| v + first)));
    both
}

/// Smooth, wavy, rough as a scan, with edges, with a hole, and of two sizes in one mesh.
fn meshes() -> Vec<(&'static str, TriangleMesh)> {
    let wavy = |waves: f32, share: f32| {
        globe(170, move |longitude, latitude| {
            let wave = (waves * longitude).sin() * (waves * latitude).sin();
            on_sphere(longitude, latitude, 0.03 * (1.0 + share * wave))
        })
    };
    let mut bits = 1_u32;
    let mut noise = move || {
        bits ^= bits << 13;
        bits ^= bits >> 17;
        bits ^= bits << 5;
        bits as f32 / u32::MAX as f32 - 0.5
    };
    let mut scan = shapes::sphere(0.03, 200);
    for vertex in &mut scan.vertices {
        *vertex = vertex.map(|x| x + 3e-5 * noise());
    }
    vec![
        ("sphere", shapes::sphere(0.03, 206)),
        ("waves", wavy(8.0, 0.05)),
        ("ripples", wavy(40.0, 0.004)),
        ("scan", scan),
        ("cube", tiled_cube(0.03, 150)),
        (
            "cylinder",
            globe(150, |longitude, latitude| {
                let (sine, cosine) = longitude.sin_cos();
                [0.02 * cosine, 0.02 * sine, 0.05 * latitude]
            }),
        ),
        (
            "two sizes",
            beside(shapes::sphere(0.03, 150), shapes::sphere(0.001, 80), 0.05),
        ),
    ]
}

fn solid(shaded: &Shaded, indices: &[u32]) -> TriMesh {
    let place = |([x, y, z], ..): &([f32; 3], [f32; 3], u32)| {
        Vector::new(f64::from(*x), f64::from(*y), f64::from(*z))
    };
    let triangles = indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]);
    TriMesh::new(
        shaded.vertices.iter().map(place).collect(),
        triangles.collect(),
    )
    .expect("triangles")
}

/// Farthest that points of one surface are from the other.
fn farthest(of: &TriMesh, from: &TriMesh) -> f64 {
    let step = (of.num_triangles() / 4000).max(1);
    let mut worst = 0.0_f64;
    for triangle in of.triangles().step_by(step) {
        let [a, b, c] = [triangle.a, triangle.b, triangle.c];
        for point in [a, a.midpoint(b), (a + b + c) / 3.0] {
            worst = worst.max(from.distance_to_local_point(point, false));
        }
    }
    worst
}

#[test]
fn no_level_is_farther_off_than_it_claims_to_be() {
    for (name, mesh) in meshes() {
        let shaded = shade(&mesh).in_drawing_order();
        let detail = Detail::of(&shaded);
        let whole = solid(&shaded, &detail.indices[..3 * mesh.triangles.len()]);
        let mut before = mesh.triangles.len() + 1;
        for level in &detail.levels {
            let indices = level.indices.start as usize..level.indices.end as usize;
            let indices = &detail.indices[indices];
            assert!(indices.len() / 3 < before, "{name}");
            before = indices.len() / 3;
            let coarse = solid(&shaded, indices);
            let off = farthest(&coarse, &whole).max(farthest(&whole, &coarse));
            let claimed = f64::from(level.error);
            println!("{name}: {before} triangles, off by {off:.2e} m of {claimed:.2e}");
            assert!(off <= claimed + 1e-8, "{name}: {off} m of {claimed}");
        }
        assert!(detail.levels.len() > 1, "{name} has one level");
    }
}

/// One body of many triangles on both screens, `scale` times as large as it is.
fn stage(mesh: TriangleMesh, scale: f64) -> Stage {
    let mut stage = peg_in_hole((480, 320), Stereo::Mono);
    stage.workbench_from_scene =
        Similarity3::new([0.0, -0.28, 0.3].into(), [0.3, 0.2, 0.0].into(), scale);
    stage.meshes[1] = mesh.into();
    stage
}

/// How many triangles were drawn, and the pictures.
fn drawn(mesh: &TriangleMesh, scale: f64, whole: bool) -> Option<(u64, Vec<RgbaImage>)> {
    let mut canvas = canvas(stage(mesh.clone(), scale))?;
    canvas.wait_for_levels();
    if whole {
        canvas.draw_all_triangles();
    }
    let latched = state(Isometry3::translation(0.0, -0.05, 0.0));
    let images = pictures(&mut canvas, &latched, Show::default());
    Some((canvas.renderer().triangles_drawn(), images))
}

#[test]
fn fewer_triangles_show_the_same_picture() {
    let some = ["sphere", "ripples", "scan", "two sizes"];
    for (name, mesh) in meshes().into_iter().filter(|(name, _)| some.contains(name)) {
        for scale in [1.0, 9.0] {
            let all = mesh.triangles.len() as u64;
            let Some(fewer) = drawn(&mesh, scale, false) else {
                return;
            };
            let whole = drawn(&mesh, scale, true).expect("as before");
            println!("{name} x {scale}: {} of {} triangles", fewer.0, whole.0);
            assert!(whole.0 > 3 * all, "{name}: two screens and shadows");
            for (fewer, whole) in fewer.1.iter().zip(&whole.1) {
                let found = difference(&halved(fewer), &halved(whole));
                assert!(found.is_unseen(), "{name} x {scale}: {found:?}");
            }
        }
    }
}
