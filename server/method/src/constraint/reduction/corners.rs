//! Pairs of corners in the way of the device: for the force each counts by the plane that the body would meet last.

use super::RowReduction;
use super::at::{At, Purpose, Surfaces};
use super::candidates::Stored;
use super::grow::Wished;
use super::met::{are_corners, clearance, met};
use super::row::{Known, face};
use crate::collision::Work;
use crate::constraint::Contact;
use crate::quasi_statics::Projection;
use crate::spatial::Vector6;

/// Pairs of corners that are set aside, and candidates that stand for another plane than their own.
#[derive(Debug)]
pub(super) struct Corners {
    known: Vec<Known>,
    /// Gaps of the candidates among them, m.
    gaps: Vec<f64>,
    /// Place, and what was collected.
    replaced: Vec<(u32, Stored)>,
}

impl Corners {
    pub(super) fn with_capacity(known: usize, candidates: usize) -> Self {
        Self {
            known: Vec::with_capacity(known),
            gaps: Vec::with_capacity(candidates),
            replaced: Vec::with_capacity(candidates),
        }
    }
}

impl RowReduction {
    /// Where a pair of corners holds back `motion`, lets each in its way count by the plane that the body would meet last.
    /// `continued` is a way as far as the motion may go on until rows are read off the pairs again: at the next pose.
    pub(crate) fn meet_corners(
        &mut self,
        of: (&At, &dyn Surfaces),
        motion: &Vector6,
        continued: impl Fn(&Vector6) -> Vector6,
        work: &mut Work,
    ) {
        let mut rows = self.known.iter();
        if !rows.any(|row| are_corners(&row.contact.features)) {
            return;
        }
        let held = self.complete_alone(of, &continued(motion), Purpose::Force, work);
        let held = held.iter().flat_map(|projection| &projection.active);
        let mut holding = held.filter_map(|row| self.known.get(row.row as usize));
        if !holding.any(|row| are_corners(&row.contact.features)) {
            return;
        }
        self.forget_corners();
        self.set_corners_aside();
        // What holds the body elsewhere leads it past some of them.
        if let Some(answer) = self.complete_alone(of, motion, Purpose::Force, work) {
            self.bring_corners_back(of, &continued(&answer.acceleration), work);
        }
    }

    pub(super) fn complete_alone(
        &mut self,
        of: (&At, &dyn Surfaces),
        motion: &Vector6,
        purpose: Purpose,
        work: &mut Work,
    ) -> Option<Projection> {
        let wished = Wished {
            motions: &[*motion],
            turning: 0,
            purpose,
        };
        self.complete(of, &wished, work).pop()
    }

    fn set_corners_aside(&mut self) {
        let aside = &mut self.corners;
        self.known.retain(|row| {
            let corners = are_corners(&row.contact.features);
            if corners {
                aside.known.push(*row);
            }
            !corners
        });
        for k in &self.candidates.corners {
            let gap = &mut self.candidates.gap[*k as usize];
            aside.gaps.push(*gap);
            *gap = f64::INFINITY;
        }
    }

    /// Some now count by another plane.
    fn bring_corners_back(&mut self, of: (&At, &dyn Surfaces), way: &Vector6, work: &mut Work) {
        let (at, surfaces) = of;
        let mut instead = |contact: &Contact| {
            // A shaded surface has its own normals.
            let counts = clearance(of, contact, way) < at.rest_distance - at.tolerance
                && surfaces.shading_normal(contact).is_none();
            // As it is, and not to first order or by the plane of a motion before.
            let contact = counts.then(|| face(at, &contact.features, false, work))?;
            met(of, &contact?, way)
        };
        for (place, gap) in self.corners.gaps.drain(..).enumerate() {
            let k = self.candidates.corners[place];
            self.candidates.gap[k as usize] = gap;
            let contact = self.candidates.contacts[k as usize];
            if let Some(met) = instead(&Contact { gap, ..contact }) {
                let row = Known::of(&met, surfaces, &at.center());
                let row = self.candidates.stored(&row);
                let collected = self.candidates.exchange(k as usize, row);
                self.corners.replaced.push((k, collected));
            }
        }
        while let Some(row) = self.corners.known.pop() {
            let met = instead(&row.contact);
            let row = met.map_or(row, |contact| Known {
                idle: row.idle,
                holds: row.holds,
                used: row.used,
                implied: row.implied,
                ..Known::of(&contact, surfaces, &at.center())
            });
            self.put_known(row);
        }
    }

    /// The candidates are again what was collected.
    pub(super) fn forget_corners(&mut self) {
        self.bring_back_passed();
        for (k, collected) in self.corners.replaced.drain(..) {
            self.candidates.exchange(k as usize, collected);
        }
    }
}
