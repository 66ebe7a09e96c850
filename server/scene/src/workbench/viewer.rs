//! Who looks: eyes, head, its tracking, comfort; and what is drawn beside the scene.

use super::device::keys_of;
use super::parts::Files;
use super::spec::{HeadTracking, Show, Viewer};
use taut_kinds::{KINDS, KindId};

use crate::document::{Range, Section, table};
use crate::scene::pose_of;

/// Largest limit on what stands out from a screen, degrees: nobody fuses more.
const MAX_DISPARITY_DEG: f64 = 30.0;

/// Reads `[viewer]`, which must be there.
pub(super) fn viewer(root: &Section<'_>, files: &Files<'_>) -> Option<Viewer> {
    root.require("viewer", "the table [viewer] with head");
    table(root, "viewer", |section| viewer_of(section, files)).flatten()
}

fn viewer_of(section: &Section<'_>, files: &Files<'_>) -> Option<Viewer> {
    let eye_separation = section.number_or("eye_separation", Range::UpTo(0.2), 0.064);
    let head = table(section, "head", pose_of);
    section.require(
        "head",
        "head = { position = [0.0, -1.3, 0.9], rotation = [0.7071, 0.7071, 0.0, 0.0] }",
    );
    let sway = table(section, "sway", |sway| HeadTracking::Sway {
        amplitude: sway.number_or("amplitude", Range::UpTo(1.0), 0.05),
        period: sway.number_or("period", Range::Positive, 6.0),
    });
    let near = section.number_or("near", Range::Positive, 0.05);
    let far = section.number_or("far", Range::Positive, 20.0);
    let separation_scale = section.number_or("separation_scale", Range::UpTo(1.0), 1.0);
    let nearest_disparity = section
        .number_or("nearest_disparity_deg", Range::UpTo(MAX_DISPARITY_DEG), 0.0)
        .to_radians();
    if near >= far {
        let text = format!("`near` ({near}) in [viewer] must be smaller than `far` ({far})");
        section.complain(section.at(), text);
    }
    let vrpn = KINDS.iter().find(|kind| kind.id == KindId::Vrpn)?;
    // A head is where it is.
    let tracker = table(section, "tracker", |tracker| {
        keys_of(vrpn, tracker, files, &["anchor"])
    });
    if sway.is_some() && tracker.is_some() {
        let text = "`tracker` and `sway` in [viewer] exclude each other; leave one out";
        section.complain_of("tracker", text);
    }
    let remote = section.boolean("remote_tracker").unwrap_or(false);
    if remote && (tracker.is_some() || sway.is_some()) {
        let what = "excludes `tracker` and `sway`; leave one out";
        section.fault("remote_tracker", what);
    }
    let tracking = match tracker {
        None if remote => HeadTracking::Remote,
        Some(chosen) => HeadTracking::Vrpn(Box::new(chosen?)),
        None => sway.unwrap_or(HeadTracking::Fixed),
    };
    Some(Viewer {
        eye_separation,
        head: head.flatten()?,
        tracking,
        near,
        far,
        separation_scale,
        nearest_disparity,
    })
}

pub(super) fn show(section: &Section<'_>) -> Show {
    let wanted = |key| section.boolean(key).unwrap_or(false);
    Show {
        ghost: wanted("ghost"),
        contacts: wanted("contacts"),
        force: wanted("force"),
        hud: wanted("hud"),
        reflections: section.boolean("reflections").unwrap_or(true),
    }
}
