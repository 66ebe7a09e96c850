//! Whatever the triangles are: what is imported is closed and looks outward, what is not is refused, and nothing panics.

use proptest::prelude::*;
use taut_scene::{ImportRequest, import};

use super::judge::{judge, one_sided};
use super::solids::{Soup, cuboid, moved, soup_of};
use super::write::{obj_soup, stl};
use crate::support::Folder;

/// A few triangles between few points: edges and faces meet in every way.
fn rubble() -> impl Strategy<Value = Soup> {
    let corner = prop::array::uniform3(0..3_u8);
    let triangle = prop::array::uniform3(corner);
    prop::collection::vec(triangle, 1..40).prop_map(|all| {
        let point = |p: [u8; 3]| p.map(|c| f64::from(c) * 0.01);
        all.into_iter().map(|t| t.map(point)).collect()
    })
}

/// A sound solid with some triangles gone, turned, doubled and without area.
fn damaged() -> impl Strategy<Value = Soup> {
    let damage = prop::collection::vec((any::<prop::sample::Index>(), 0..4_u8), 0..6);
    (0..3_u8, damage).prop_map(|(solid, damage)| {
        let mut soup = match solid {
            0 => cuboid([0.01, 0.02, 0.03]),
            1 => soup_of(&taut_scene::shapes::sphere(0.02, 2)),
            _ => [
                cuboid([0.01; 3]),
                moved(cuboid([0.01; 3]), [0.02, 0.02, 0.0]),
            ]
            .concat(),
        };
        for (place, kind) in damage {
            let t = place.index(soup.len());
            let [a, b, c] = soup[t];
            match kind {
                0 => drop(soup.remove(t)),
                1 => soup[t] = [a, c, b],
                2 => soup.push([a, b, c]),
                _ => soup.push([a, b, a]),
            }
        }
        soup
    })
}

fn imported(
    file: &str,
    bytes: &[u8],
    thicken: Option<f64>,
    close_holes: Option<usize>,
) -> Option<Soup> {
    let folder = Folder::new();
    folder.write(file, bytes);
    let request = ImportRequest {
        thicken,
        close_holes,
        ..folder.request(&[file])
    };
    let report = import(&request).ok()?;
    let verdict = judge(&request.folder.join(&report.parts[0].mesh_file));
    assert!(verdict.closed, "{report}");
    assert!(verdict.volumes.iter().sum::<f64>() > 0.0, "{report}");
    Some(verdict.soup)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn rubble_is_refused_or_becomes_a_closed_surface(soup in rubble(), thick: bool, close: bool) {
        imported("a.stl", &stl(&soup), thick.then_some(1e-3), close.then_some(64));
    }

    #[test]
    fn damage_is_mended_or_refused_and_the_rest_of_the_surface_stays(soup in damaged()) {
        if let Some(mended) = imported("a.obj", &obj_soup(&soup), None, None) {
            let lost = one_sided(&soup, &mended);
            prop_assert!(lost < 1e-6, "{lost} m from the part");
        }
    }
}
