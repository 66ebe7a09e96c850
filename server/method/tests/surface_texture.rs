//! Textures: tilts in closed form, averaged over contacts, and a clean tone at any rate of the god-object loop.

use crate::geometry_shapes;

use std::f64::consts::TAU;
use std::sync::Arc;

use crate::support::{box_obstacle, box_on_table};
use god_object::constraint::Feature;
use god_object::nalgebra::{Matrix3, Point3, UnitQuaternion, Vector3};
use god_object::spatial::{angular, linear};
use god_object::surface::{CornerCoordinates, TextureCoordinatesError, Textures};
use god_object::{
    Body, Coupling, GodObject, HeightMap, HeightMapTexture, Obstacle, Pose, Settings, SineTexture,
    Texture, TextureCoordinates, UvHeightMapTexture, Vector6, World,
};

const SINE: SineTexture = SineTexture {
    axis: Vector3::new(1.0, 0.0, 0.0),
    wavelength: 2e-3,
    amplitude: 0.2,
};

fn table_with(texture: Option<Texture>) -> World {
    let mut world = World::clone(&box_on_table());
    world.obstacles[0].pose = Pose::identity();
    world.obstacles[0].surface.texture = texture;
    world
}

type Touched = (u16, Feature, Point3<f64>, Vector3<f64>);

fn contact_at(x: f64) -> Touched {
    (0, Feature::Face(0), Point3::new(x, 0.0, 0.0), Vector3::z())
}

fn tilted(texture: Texture, contacts: &[Touched]) -> Vector6 {
    let wrench = Vector6::new(0.0, 0.0, 5.0, 0.0, 0.0, 0.0);
    Textures::of(&table_with(Some(texture)))
        .expect("a texture")
        .tilt(
            &wrench,
            &Pose::identity(),
            &Vector6::zeros(),
            true,
            contacts.iter().copied(),
        )
}

#[test]
fn the_force_tilts_by_the_sine_and_keeps_its_magnitude() {
    let felt = tilted(Texture::Sine(SINE), &[contact_at(0.5e-3)]);
    assert!((linear(&felt).norm() - 5.0).abs() < 1e-12);
    assert!((felt[0] / felt[2] - 0.2).abs() < 1e-12);
    let arm = Vector3::new(0.5e-3, 0.0, 0.0);
    let torque = arm.cross(&(linear(&felt) - Vector3::z() * 5.0));
    assert!((angular(&felt) - torque).norm() < 1e-12);
}

#[test]
fn a_texture_goes_with_its_obstacle() {
    let world = table_with(Some(Texture::Sine(SINE)));
    let wrench = Vector6::new(0.0, 0.0, 5.0, 0.0, 0.0, 0.0);
    let tilt = |place: &Pose, contact: Touched| {
        let mut textures = Textures::of(&world).expect("a texture");
        textures.place(0, place);
        textures.place(7, &Pose::translation(9.0, 0.0, 0.0)); // none of the world's
        let still = Vector6::zeros();
        textures.tilt(
            &wrench,
            &Pose::identity(),
            &still,
            true,
            [contact].into_iter(),
        )
    };
    let stood = tilt(&Pose::identity(), contact_at(0.5e-3));
    let gone = tilt(&Pose::translation(0.3e-3, 0.0, 0.0), contact_at(0.8e-3));
    assert!((linear(&gone) - linear(&stood)).norm() < 1e-12);
    // A quarter turn about the normal: the sine runs along y.
    let turned = Pose::rotation(Vector3::z() * (0.25 * TAU));
    let felt = tilt(
        &turned,
        (
            0,
            Feature::Face(0),
            Point3::new(0.0, 0.5e-3, 0.0),
            Vector3::z(),
        ),
    );
    assert!((felt[1] / felt[2] - 0.2).abs() < 1e-12 && felt[0].abs() < 1e-12);
}

#[test]
fn tilts_of_several_contacts_are_averaged() {
    let crest_and_trough = [contact_at(0.5e-3), contact_at(1.5e-3)];
    let felt = tilted(Texture::Sine(SINE), &crest_and_trough);
    assert!((felt - Vector6::new(0.0, 0.0, 5.0, 0.0, 0.0, 0.0)).norm() < 1e-12);
    let crest_and_zero = [contact_at(0.5e-3), contact_at(1.0e-3)];
    let felt = tilted(Texture::Sine(SINE), &crest_and_zero);
    assert!((felt[0] / felt[2] - 0.1).abs() < 1e-12);
}

#[test]
fn a_world_without_texture_has_no_textures() {
    assert!(Textures::of(&table_with(None)).is_none());
}

#[test]
fn on_a_height_map_the_force_leans_down_the_slope() {
    // Waves of 1 mm along x, 0.1 mm high: the gradient is pi A / wavelength at a flank.
    let (width, waves) = (128, 4.0);
    let heights: Vec<f64> = (0..width * width)
        .map(|i| 0.5 - 0.5 * (TAU * waves * (i % width) as f64 / width as f64).cos())
        .collect();
    let texture = Texture::HeightMap(HeightMapTexture {
        map: Arc::new(HeightMap::new(width, &heights).expect("a map")),
        tile: 4e-3,
        amplitude: 1e-4,
    });
    let felt = tilted(texture, &[contact_at(0.25e-3)]);
    let gradient = std::f64::consts::PI * 1e-4 / 1e-3;
    assert!((linear(&felt).norm() - 5.0).abs() < 1e-12);
    assert!(
        (felt[0] / felt[2] + gradient).abs() < 0.01 * gradient,
        "{felt}"
    );
}

#[test]
fn a_picture_laid_on_by_texture_coordinates_feels_as_the_same_picture_along_the_axes() {
    let (width, tile) = (64, 4e-3);
    let heights: Vec<f64> = (0..width * width)
        .map(|i| {
            let [u, v] = [i % width, i / width].map(|k| TAU * k as f64 / width as f64);
            0.5 + 0.3 * u.sin() + 0.2 * (u + 2.0 * v).cos()
        })
        .collect();
    let map = Arc::new(HeightMap::new(width, &heights).expect("a map"));
    // The middle of the first texel lies at the origin; seen from above, x and y are u and v.
    let plate = plate();
    let corner = |p: Point3<f64>| [p.x, p.y].map(|x| x / tile + 0.5 / width as f64);
    let count = plate.mesh.triangles().len() as u32;
    let coordinates: Vec<CornerCoordinates> = (0..count)
        .map(|t| plate.mesh.corners(t).map(corner))
        .collect();
    let along_axes = Texture::HeightMap(HeightMapTexture {
        map: map.clone(),
        tile,
        amplitude: 1e-4,
    });
    let by_coordinates = Texture::UvHeightMap(UvHeightMapTexture {
        map,
        coordinates: Arc::new(TextureCoordinates::new(&plate.mesh, &coordinates).expect("fit")),
        amplitude: 1e-4,
    });
    for (speed, period) in [(0.05, 1), (0.05, 14)] {
        let expected = slide(along_axes.clone(), speed, period);
        let felt = slide(by_coordinates.clone(), speed, period);
        let largest = expected.iter().fold(0.0_f64, |most, f| most.max(f.abs()));
        assert!(largest > 0.1, "{largest}");
        for (felt, expected) in felt.iter().zip(&expected) {
            assert!(
                (felt - expected).abs() < 1e-9 * largest,
                "{felt} {expected}"
            );
        }
    }
}

#[test]
fn texture_coordinates_that_do_not_fit_the_mesh_are_refused() {
    let plate = plate();
    let mut coordinates = vec![[[0.0; 2]; 3]; plate.mesh.triangles().len()];
    coordinates[3][1][0] = f64::NAN;
    let refused = |given: &[CornerCoordinates]| TextureCoordinates::new(&plate.mesh, given).err();
    assert_eq!(
        refused(&coordinates),
        Some(TextureCoordinatesError::NotFinite { triangle: 3 })
    );
    assert_eq!(
        refused(&coordinates[..3]),
        Some(TextureCoordinatesError::Count {
            given: 3,
            triangles: 12
        })
    );
}

fn plate() -> Obstacle {
    box_obstacle("plate", Vector3::new(0.3, 0.05, 0.01), Vector3::zeros())
}

/// Wrenches on a box that is pressed flat on a textured table and slides; vertex k of the box has number `numbers[k]`, and its triangles are turned
/// round as many places as the first number says.
fn felt_by_box(numbers: [u32; 8]) -> Vec<Vector6> {
    let mut world = World::clone(&box_on_table());
    world.obstacles[0].surface.texture = Some(Texture::Sine(SineTexture {
        axis: Vector3::new(0.8, 0.6, 0.0),
        wavelength: 10e-3,
        amplitude: 0.2,
    }));
    let plain = &world.body.mesh;
    let mut vertices = vec![Point3::origin(); 8];
    for (vertex, number) in plain.vertices().iter().zip(numbers) {
        vertices[number as usize] = *vertex;
    }
    let renamed = |t: &[u32; 3]| t.map(|v| numbers[v as usize]);
    let mut triangles: Vec<[u32; 3]> = plain.triangles().iter().map(renamed).collect();
    triangles.rotate_left(numbers[0] as usize);
    world.body.mesh = god_object::Mesh::new(vertices, triangles).expect("the same box");
    let world = Arc::new(world);
    let settings = Settings::for_size(0.04);
    let at = |x: f64, z: f64| Pose::translation(x, 0.2 * x, z);
    let mut coupling = Coupling::new(&world, &settings);
    let mut god_object = GodObject::new(world, settings, at(0.0, 0.011)).expect("free");
    let step = |i: u32| {
        let t = 1e-3 * f64::from(i);
        let device = at(0.03 * t, (0.011 - 0.05 * t).max(0.007));
        god_object.step(&device, None);
        coupling
            .step(t, &device, god_object.constraint_set())
            .wrench
    };
    (0..300).map(step).collect()
}

#[test]
fn renumbering_vertices_leaves_the_felt_texture_as_it_was() {
    let plain = felt_by_box([0, 1, 2, 3, 4, 5, 6, 7]);
    let tilted = plain.iter().filter(|w| w[0].abs() > 0.05).count();
    assert!(tilted > 50, "the texture is felt {tilted} times");
    for numbers in [
        [7, 6, 5, 4, 3, 2, 1, 0],
        [3, 0, 2, 1, 5, 7, 4, 6],
        [2, 5, 7, 1, 0, 3, 6, 4],
        [1, 3, 0, 2, 6, 4, 7, 5],
    ] {
        for (i, (felt, same)) in felt_by_box(numbers).iter().zip(&plain).enumerate() {
            let apart = (felt - same).norm();
            assert!(apart < 1e-6, "{numbers:?}, step {i}: {felt} and {same}");
        }
    }
}

/// Sideways force per ms of a tip that slides at `speed` on `texture`, the god-object updated every `period` ms.
fn slide(texture: Texture, speed: f64, period: usize) -> Vec<f64> {
    let mut plate = plate();
    plate.surface.texture = Some(texture);
    let world = Arc::new(World {
        body: Body {
            primitive: None,
            mesh: geometry_shapes::mesh(geometry_shapes::icosphere(2e-3, 2)),
            mass: 1.0,
            inertia: Matrix3::identity() * 1.6e-6,
            reference_point: Point3::origin(),
        },
        obstacles: vec![plate],
    });
    let settings = Settings::for_size(4e-3);
    let at = |x: f64, depth: f64| {
        Pose::from_parts(
            Vector3::new(x, 0.0, 0.012 - depth).into(),
            UnitQuaternion::identity(),
        )
    };
    let mut coupling = Coupling::new(&world, &settings);
    let mut god_object = GodObject::new(world, settings, at(-0.1, -1e-3)).expect("free");
    let mut forces = Vec::new();
    for i in 0..800 {
        let t = f64::from(i) * 1e-3;
        let device = at(-0.1 + speed * t, (-1e-3 + 0.04 * t).min(3e-3));
        if (i as usize).is_multiple_of(period) {
            god_object.step(&device, None);
        }
        let felt = coupling.step(t, &device, god_object.constraint_set());
        if i >= 300 {
            forces.push(felt.wrench[0]);
        }
    }
    forces
}

/// Amplitude at each whole multiple of 2 Hz up to 500 Hz, of 500 samples at 1 kHz.
fn spectrum(samples: &[f64]) -> Vec<f64> {
    let mean = samples.iter().sum::<f64>() / samples.len() as f64;
    (0..=samples.len() / 2)
        .map(|k| {
            let (mut re, mut im) = (0.0, 0.0);
            for (i, sample) in samples.iter().enumerate() {
                let phase = TAU * k as f64 * i as f64 / samples.len() as f64;
                re += (sample - mean) * phase.cos();
                im += (sample - mean) * phase.sin();
            }
            2.0 * re.hypot(im) / samples.len() as f64
        })
        .collect()
}

#[test]
fn the_tone_of_a_sine_is_clean_at_any_rate_of_the_god_object() {
    // R29: 1 mm at 0.2 m/s is 200 Hz.
    let texture = Texture::Sine(SineTexture {
        wavelength: 1e-3,
        ..SINE
    });
    for period in [1, 3, 14] {
        let amplitudes = spectrum(&slide(texture.clone(), 0.2, period));
        let tone = amplitudes[100];
        let (place, loudest) = amplitudes
            .iter()
            .enumerate()
            .filter(|(k, _)| k.abs_diff(100) > 1)
            .fold(
                (0, 0.0),
                |best, (k, a)| if *a > best.1 { (k, *a) } else { best },
            );
        let decibels = 20.0 * (tone / loudest).log10();
        println!(
            "sets every {period} ms: {tone:.3} N at 200 Hz, next {loudest:.2e} N at {} Hz: {decibels:.1} dB",
            2 * place
        );
        assert!(tone > 0.4, "{tone}");
        assert!(decibels > 20.0, "{period} ms: {decibels} dB");
    }
}

#[test]
fn a_sine_above_half_the_rate_is_muted() {
    // 0.3 mm at 0.2 m/s is 667 Hz: sampled at 1 kHz it would be felt as 333 Hz.
    let fine = Texture::Sine(SineTexture {
        wavelength: 0.3e-3,
        ..SINE
    });
    let loudest = spectrum(&slide(fine.clone(), 0.2, 1))
        .into_iter()
        .fold(0.0, f64::max);
    assert!(loudest < 1e-3, "{loudest} N");
    // Slowly it is all there.
    let slow = spectrum(&slide(fine, 0.03, 1));
    assert!(slow[50] > 0.4, "{} N at 100 Hz", slow[50]);
}
