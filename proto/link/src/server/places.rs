//! Who finds room: places are kept for those whom the workbench cannot do without.
//!
//! The device bridge, the tracker, one operator and every render node that the workbench names have a place of their own, whoever else is in.
//! Observers, further operators and render nodes of other names share what is left. Who has not proven anything yet has no place here at
//! all: joining has its own (see [`super::joining`]).

use std::collections::BTreeSet;
use taut_proto::{Role, barrier::MAX_MEMBERS};

/// Places beside those of the render nodes: device bridge, tracker, operator.
const SINGLE_PLACES: usize = 3;

/// Session numbers are 1 to 65535: half of them are always free.
const MOST_CLIENTS: usize = 1 << 15;

/// The places of one workbench.
pub(crate) struct Places {
    nodes: BTreeSet<String>,
    /// Clients without a place of their own.
    shared: usize,
    /// Render nodes whose frames go together; `None` where each draws by itself.
    in_step: Option<usize>,
}

impl Places {
    /// `most` clients in all, but never fewer than have a place of their own.
    pub(crate) fn new(most: usize, nodes: &[String], locks_frames: bool) -> Places {
        let nodes: BTreeSet<_> = nodes.iter().cloned().collect();
        Places {
            shared: most
                .min(MOST_CLIENTS)
                .saturating_sub(SINGLE_PLACES + nodes.len()),
            nodes,
            in_step: locks_frames.then_some(MAX_MEMBERS),
        }
    }

    /// Whether a client finds room beside those who are `present`; if not, why and what to do.
    pub(crate) fn check<'a>(
        &self,
        present: impl Iterator<Item = (Role, &'a str)> + Clone,
        (role, node): (Role, &str),
    ) -> Result<(), String> {
        let of_role = |wanted| present.clone().filter(move |(role, _)| *role == wanted);
        let named = self.nodes.contains(node);
        let is_named = |(_, node): &(Role, &str)| self.nodes.contains(*node);
        let strange_renders = of_role(Role::Render).filter(|of| !is_named(of)).count();
        if let (Role::Render, Some(most)) = (role, self.in_step) {
            // Frames are kept for the named ones, too.
            let (here, room) = match named {
                true => (of_role(Role::Render).filter(is_named).count(), most),
                false => (strange_renders, most.saturating_sub(self.nodes.len())),
            };
            if here >= room {
                return Err(format!(
                    "the frames of {most} render nodes are kept together, and there is no room for another: stop one, or set swap = \"off\" in [frames]"
                ));
            }
        }
        let operators = of_role(Role::Operator).count();
        let has_own = match role {
            Role::Device | Role::Tracker => true,
            Role::Operator => operators == 0,
            Role::Render => named,
            Role::Observer | Role::Force => false,
        };
        let sharing = of_role(Role::Observer).count()
            + of_role(Role::Force).count()
            + operators.saturating_sub(1)
            + strange_renders;
        if has_own || sharing < self.shared {
            return Ok(());
        }
        Err(format!(
            "its {} places beside those of device, tracker, operator and {} named render nodes are taken: stop a client, or raise max_clients",
            self.shared,
            self.nodes.len()
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn places(most: usize) -> Places {
        Places::new(most, &["front".to_owned(), "table".to_owned()], true)
    }

    /// Lets in whoever finds room, in this order; how many did.
    fn crowd(places: &Places, role: Role, tries: usize) -> Vec<(Role, String)> {
        let mut present: Vec<(Role, String)> = Vec::new();
        for number in 0..tries {
            let name = format!("{role}-{number}");
            let here = present.iter().map(|(role, node)| (*role, node.as_str()));
            if places.check(here, (role, &name)).is_ok() {
                present.push((role, name));
            }
        }
        present
    }

    #[test]
    fn a_full_house_of_any_role_leaves_room_for_those_who_are_needed() {
        for role in [Role::Observer, Role::Operator, Role::Render] {
            for most in [0, 1, 5, 8, 300] {
                let places = places(most);
                let mut present = crowd(&places, role, 400);
                assert!(present.len() <= most.saturating_sub(5) + 1, "{role} {most}");
                for needed in [
                    (Role::Device, "bridge"),
                    (Role::Tracker, "tracker"),
                    (Role::Render, "front"),
                    (Role::Render, "table"),
                ] {
                    let here = present.iter().map(|(role, node)| (*role, node.as_str()));
                    let check = places.check(here, needed);
                    assert!(check.is_ok(), "{role} {most} {needed:?}: {check:?}");
                    present.push((needed.0, needed.1.to_owned()));
                }
            }
        }
    }

    #[test]
    fn the_first_operator_has_a_place_and_the_second_shares() {
        let places = places(5);
        let alice = [(Role::Operator, "alice")];
        assert!(places.check([].into_iter(), alice[0]).is_ok());
        let check = places.check(alice.into_iter(), (Role::Operator, "bob"));
        assert!(check.is_err_and(|text| text.contains("0 places")));
    }

    #[test]
    fn a_render_node_beyond_those_in_step_is_told_so() {
        let names: Vec<_> = (0..40).map(|n| format!("node-{n}")).collect();
        let places = Places::new(256, &names, true);
        let present = names[..MAX_MEMBERS].iter();
        let present = present.map(|node| (Role::Render, node.as_str()));
        let check = places.check(present.clone(), (Role::Render, "node-32"));
        assert!(check.is_err_and(|text| text.contains("frames of 32 render nodes")));
        let alone = Places::new(256, &names, false);
        assert!(alone.check(present, (Role::Render, "node-32")).is_ok());
    }
}
