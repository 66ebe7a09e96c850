//! The nearest of many rows.

use super::Contact;

/// Where rows go: the nearest, and of those that others imply.
pub(super) struct Rows<'a> {
    pub(super) nearest: Nearest<'a>,
    pub(super) implied: Nearest<'a>,
}

impl Rows<'_> {
    #[inline]
    pub(super) fn take(&mut self, contact: Contact, implied: bool) {
        let rows = if implied {
            &mut self.implied
        } else {
            &mut self.nearest
        };
        rows.take(contact);
    }

    /// Leaves them in the nearest; whether some were left out.
    pub(super) fn finish(mut self) -> bool {
        self.implied.finish();
        let implied = self.implied.candidates.iter();
        implied.for_each(|contact| self.nearest.take(*contact));
        self.nearest.finish();
        self.nearest.truncated
    }
}

/// The nearest of the contacts that it is given, at most `room` of them in the end.
pub(super) struct Nearest<'a> {
    candidates: &'a mut Vec<Contact>,
    /// Most held at a time, twice the room or more.
    limit: usize,
    room: usize,
    /// What is farther is not taken, m.
    pub(super) within: f64,
    /// Some were left out.
    truncated: bool,
}

impl<'a> Nearest<'a> {
    pub(super) fn new(
        candidates: &'a mut Vec<Contact>,
        [limit, room]: [usize; 2],
        within: f64,
    ) -> Self {
        candidates.clear();
        Self {
            candidates,
            limit,
            room,
            within,
            truncated: false,
        }
    }

    #[inline]
    pub(super) fn take(&mut self, contact: Contact) {
        let near = contact.gap >= 0.0 && contact.gap <= self.within; // false for NaN
        if !near {
            return;
        }
        if self.candidates.len() == self.limit {
            self.keep();
        }
        self.candidates.push(contact);
    }

    /// Leaves the nearest, nearest first.
    pub(super) fn finish(&mut self) {
        self.keep();
        self.candidates.sort_unstable_by(nearer);
    }

    fn keep(&mut self) {
        if self.room < self.candidates.len() {
            let (_, next, _) = self.candidates.select_nth_unstable_by(self.room, nearer);
            self.within = next.gap;
            self.candidates.truncate(self.room);
            self.truncated = true;
        }
    }
}

/// By gap, then by features: the order says nothing of the traversal.
pub(super) fn nearer(a: &Contact, b: &Contact) -> std::cmp::Ordering {
    a.gap
        .total_cmp(&b.gap)
        .then_with(|| a.features.cmp(&b.features))
}
