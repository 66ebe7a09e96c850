//! A name for what a session was computed on: other bodies or settings have another name.

use std::fmt::Write as _;

use god_object::spatial::Pose;
use god_object::{Mesh, Settings, World};

/// A hash, in hexadecimal, of everything that the method is given before the first update: bodies, settings, start.
///
/// It covers every vertex, triangle and number bit by bit. Names of obstacles do not count.
#[must_use]
pub fn identity_of(world: &World, settings: &Settings, start: &Pose) -> String {
    let mut hasher = blake3::Hasher::new();
    let mut text = String::new();
    // Debug output prints the shortest text that reads back as the same number: equal text is equal bits, but for NaN.
    let mut part = |value: &dyn std::fmt::Debug, hasher: &mut blake3::Hasher| {
        text.clear();
        let _ = write!(text, "{value:?};"); // writing to a String cannot fail
        hasher.update(text.as_bytes());
    };
    let body = &world.body;
    mesh(&body.mesh, &mut hasher);
    part(&body.primitive, &mut hasher);
    part(&body.mass, &mut hasher);
    part(&body.inertia, &mut hasher);
    part(&body.reference_point, &mut hasher);
    for obstacle in &world.obstacles {
        mesh(&obstacle.mesh, &mut hasher);
        part(&obstacle.primitive, &mut hasher);
        part(&obstacle.pose, &mut hasher);
        part(&obstacle.surface, &mut hasher);
    }
    part(settings, &mut hasher);
    part(start, &mut hasher);
    hasher.finalize().to_hex().to_string()
}

fn mesh(mesh: &Mesh, hasher: &mut blake3::Hasher) {
    for vertex in mesh.vertices() {
        for coordinate in vertex.iter() {
            hasher.update(&coordinate.to_le_bytes());
        }
    }
    hasher.update(b";");
    for triangle in mesh.triangles() {
        for index in triangle {
            hasher.update(&index.to_le_bytes());
        }
    }
    hasher.update(b";");
}
