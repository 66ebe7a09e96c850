//! What a server tells a bridge at join: mass properties, constants and surfaces, from the method's world and back to one.
//!
//! The bridge's world has no geometry: a tetrahedron as large as the body stands for it, a small one for each obstacle. The
//! coupling looks at none of them but for the body's radius.

use god_object::nalgebra::{Matrix3, Point3, Vector3};
use god_object::{
    Body, Mesh, Obstacle, Settings, SettingsError, SineTexture, Surface, Texture, World,
};
use taut_link::proto::codec::encode_onto;
use taut_link::proto::coupling::{EdgeSine, EdgeSurface};
use taut_link::proto::{CouplingOffer, EdgeCoupling, EncodeError, PoseF64};

use super::settings::{from_wire, to_wire};

/// A unit vector may be this far from unit length: some roundings.
const UNIT_TOLERANCE: f64 = 1e-9;

/// Why a server's offer makes no coupling.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum OfferError {
    /// A constant is out of range.
    #[error("the server's coupling cannot be used: {0}; install the same release on both sides")]
    Settings(#[from] SettingsError),
    /// Mass, inertia, radius, a surface or a pose is none.
    #[error("the server's coupling has {0} that is none; install the same release on both sides")]
    Invalid(&'static str),
}

/// What a server with this world, whose obstacles `moving` move, offers its bridge, `set_rate_hz` sets a second; the reason where it keeps the coupling.
///
/// # Errors
/// A number of the scene that no program takes from another, by its name.
pub fn offer_of(
    world: &World,
    settings: &Settings,
    moving: impl IntoIterator<Item = usize>,
    set_rate_hz: f64,
) -> Result<CouplingOffer, EncodeError> {
    let at_server = |reason: String| {
        Ok(CouplingOffer::AtServer {
            reason: reason.into(),
        })
    };
    let settings = match to_wire(settings) {
        Ok(settings) => settings,
        Err(reason) => return at_server(reason.to_string()),
    };
    let World { body, obstacles } = world;
    let Some(obstacles) = obstacles.iter().map(wire_surface).collect() else {
        return at_server("a surface has a height map, which does not travel".to_owned());
    };
    // Rows say what obstacles did, not where they are, and a texture goes with its obstacle.
    let is_textured = |place: usize| world.obstacles[place].surface.texture.is_some();
    if moving.into_iter().any(is_textured) {
        return at_server("an obstacle with a texture moves, and that does not travel".to_owned());
    }
    // Shapes stay here: the coupling asks for the radius alone.
    let Body {
        mesh,
        primitive: _,
        mass,
        inertia,
        reference_point,
    } = body;
    let mut rows = [0.0; 9];
    // Column by column or row by row: it is symmetric.
    rows.copy_from_slice(inertia.as_slice());
    let offer = CouplingOffer::AtEdge(EdgeCoupling {
        mass: *mass,
        inertia: rows,
        reference_point: reference_point.coords.into(),
        radius: mesh.radius_about(reference_point),
        settings,
        set_rate_hz,
        obstacles,
    });
    encode_onto(&offer, &mut Vec::new()).map(|()| offer)
}

/// How an obstacle feels; `None` where that does not travel.
fn wire_surface(obstacle: &Obstacle) -> Option<EdgeSurface> {
    // Its shape comes as rows, shading as their normals.
    let Obstacle {
        name: _,
        mesh: _,
        primitive: _,
        pose,
        surface:
            Surface {
                shading: _,
                texture,
                friction,
            },
    } = obstacle;
    let sine = match texture {
        None => None,
        Some(Texture::Sine(SineTexture {
            axis,
            wavelength,
            amplitude,
        })) => Some(EdgeSine {
            axis: (*axis).into(),
            wavelength: *wavelength,
            amplitude: *amplitude,
        }),
        Some(_) => return None,
    };
    Some(EdgeSurface {
        pose: PoseF64::from_isometry(pose),
        friction: *friction,
        sine,
    })
}

/// The world and the settings of a coupling as offered.
///
/// # Errors
/// [`OfferError`]: a number that no scene has.
pub fn world_of(offer: &EdgeCoupling) -> Result<(World, Settings), OfferError> {
    let positive = |value: f64, what| {
        let positive = value.is_finite() && value > 0.0;
        positive.then_some(value).ok_or(OfferError::Invalid(what))
    };
    let mass = positive(offer.mass, "a mass")?;
    let radius = positive(offer.radius, "a radius")?;
    positive(offer.set_rate_hz, "a rate of sets")?;
    let inertia = Matrix3::from_row_slice(&offer.inertia);
    let definite = inertia == inertia.transpose() && inertia.cholesky().is_some();
    if !definite {
        return Err(OfferError::Invalid("an inertia tensor"));
    }
    let mut reference_point = Point3::from(offer.reference_point);
    if !reference_point.iter().all(|x| x.is_finite()) {
        reference_point = Point3::origin();
    }
    let settings = from_wire(&offer.settings)?;
    let obstacles = offer
        .obstacles
        .iter()
        .map(obstacle)
        .collect::<Result<_, _>>()?;
    let world = World {
        body: Body {
            mesh: tetrahedron(&reference_point, radius)?,
            primitive: None,
            mass,
            inertia,
            reference_point,
        },
        obstacles,
    };
    Ok((world, settings))
}

fn obstacle(surface: &EdgeSurface) -> Result<Obstacle, OfferError> {
    let pose = surface.pose.to_isometry();
    let pose = pose.ok_or(OfferError::Invalid("an obstacle's pose"))?;
    let friction = surface.friction;
    if !(friction.is_finite() && friction >= 0.0) {
        return Err(OfferError::Invalid("a coefficient of friction"));
    }
    let texture = surface.sine.map(sine).transpose()?.map(Texture::Sine);
    Ok(Obstacle {
        name: String::new(),
        mesh: tetrahedron(&Point3::origin(), 1.0)?,
        primitive: None,
        pose,
        surface: Surface {
            shading: None, // shading normals come with the rows
            texture,
            friction,
        },
    })
}

fn sine(sine: EdgeSine) -> Result<SineTexture, OfferError> {
    let axis = Vector3::from(sine.axis);
    let valid = (axis.norm() - 1.0).abs() <= UNIT_TOLERANCE
        && sine.wavelength.is_finite()
        && sine.wavelength > 0.0
        && sine.amplitude.is_finite();
    valid
        .then_some(SineTexture {
            axis,
            wavelength: sine.wavelength,
            amplitude: sine.amplitude,
        })
        .ok_or(OfferError::Invalid("a texture"))
}

/// A regular tetrahedron with its corners at `radius` around `center`, m.
fn tetrahedron(center: &Point3<f64>, radius: f64) -> Result<Mesh, OfferError> {
    let corner =
        |x: f64, y: f64, z: f64| center + Vector3::new(x, y, z) * (radius / 3.0_f64.sqrt());
    let corners = vec![
        corner(1.0, 1.0, 1.0),
        corner(1.0, -1.0, -1.0),
        corner(-1.0, 1.0, -1.0),
        corner(-1.0, -1.0, 1.0),
    ];
    let faces = vec![[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]];
    Mesh::new(corners, faces).map_err(|_| OfferError::Invalid("a size"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use god_object::{Pose, RotationMetric};
    use taut_link::proto::constraints::MAX_SET_ROWS;

    fn scene() -> (World, Settings) {
        let size = 0.05;
        let obstacle = |friction, texture| Obstacle {
            name: "wall".to_owned(),
            mesh: tetrahedron(&Point3::origin(), 0.3).expect("a mesh"),
            primitive: None,
            pose: Pose::translation(0.1, 0.2, 0.3),
            surface: Surface {
                shading: None,
                texture,
                friction,
            },
        };
        let sine = Texture::Sine(SineTexture {
            axis: Vector3::y(),
            wavelength: 2e-3,
            amplitude: 0.2,
        });
        let world = World {
            body: Body {
                mesh: tetrahedron(&Point3::new(0.01, 0.0, 0.0), size).expect("a mesh"),
                primitive: None,
                mass: 0.7,
                inertia: Matrix3::from_diagonal(&Vector3::new(2.0, 3.0, 4.0)) * 1e-3,
                reference_point: Point3::new(0.01, 0.0, 0.0),
            },
            obstacles: vec![obstacle(0.0, None), obstacle(0.3, Some(sine))],
        };
        let settings = Settings {
            k_s: 0.7,
            k_h: 1500.0,
            rotation_metric: RotationMetric::RadiusOfGyration(0.03),
            implicit_rounds: 2,
            force_limit: 15.0,
            ..Settings::for_size(size)
        };
        (world, settings)
    }

    fn offered(world: &World, settings: &Settings) -> EdgeCoupling {
        match offer_of(world, settings, [], 1000.0) {
            Ok(CouplingOffer::AtEdge(offer)) => offer,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn what_the_coupling_asks_of_a_world_comes_back() {
        let (world, settings) = scene();
        let (there, back) = world_of(&offered(&world, &settings)).expect("a world");
        assert_eq!(there.body.mass, world.body.mass);
        assert_eq!(there.body.inertia, world.body.inertia);
        assert_eq!(there.body.reference_point, world.body.reference_point);
        let radius = |world: &World| world.body.mesh.radius_about(&world.body.reference_point);
        assert!((radius(&there) - radius(&world)).abs() < 1e-15);
        for (there, here) in there.obstacles.iter().zip(&world.obstacles) {
            assert_eq!((&there.pose, &there.surface), (&here.pose, &here.surface));
        }
        assert_eq!(back, settings);
    }

    #[test]
    fn a_height_map_and_too_many_rows_stay_at_the_server_and_what_nobody_takes_is_refused() {
        let (mut world, settings) = scene();
        let many = Settings {
            max_constraints: MAX_SET_ROWS + 1,
            ..settings
        };
        assert!(matches!(
            offer_of(&world, &many, [], 1000.0),
            Ok(CouplingOffer::AtServer { .. })
        ));
        let stiff = Settings {
            k_h: 1e13,
            ..settings
        };
        let refused = offer_of(&world, &stiff, [], 1000.0).expect_err("nobody would take it");
        assert!(
            refused
                .to_string()
                .contains("EdgeSettings.k_h out of its range")
        );
        let map = god_object::HeightMap::new(2, &[0.0; 4]);
        world.obstacles[0].surface.texture = map.ok().map(|map| {
            Texture::HeightMap(god_object::HeightMapTexture {
                map: std::sync::Arc::new(map),
                tile: 0.1,
                amplitude: 1e-4,
            })
        });
        assert!(matches!(
            offer_of(&world, &settings, [], 1000.0),
            Ok(CouplingOffer::AtServer { .. })
        ));
    }

    #[test]
    fn a_texture_that_moves_stays_at_the_server_and_one_that_stands_does_not() {
        let (world, settings) = scene();
        for (moving, stays) in [(vec![], false), (vec![0], false), (vec![0, 1], true)] {
            let offer = offer_of(&world, &settings, moving, 1000.0);
            let at_server = matches!(offer, Ok(CouplingOffer::AtServer { .. }));
            assert_eq!(at_server, stays, "{offer:?}");
        }
    }

    #[test]
    fn an_offer_that_no_scene_makes_is_refused() {
        let (world, settings) = scene();
        let good = offered(&world, &settings);
        let refused = |change: fn(&mut EdgeCoupling)| {
            let mut offer = good.clone();
            change(&mut offer);
            world_of(&offer).expect_err("nonsense").to_string()
        };
        for (sentence, part) in [
            (refused(|offer| offer.mass = 0.0), "a mass"),
            (
                refused(|offer| offer.inertia[0] = -1.0),
                "an inertia tensor",
            ),
            (refused(|offer| offer.radius = f64::NAN), "a radius"),
            (refused(|offer| offer.settings.k_s = 2.0), "k_s"),
            (
                refused(|offer| offer.obstacles[1].friction = -1.0),
                "friction",
            ),
            (
                refused(|offer| offer.obstacles[0].pose.rotation = [0.0; 4]),
                "pose",
            ),
        ] {
            assert!(sentence.contains(part), "{sentence}");
        }
    }
}
