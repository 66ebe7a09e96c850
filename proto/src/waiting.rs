//! Those who have come and proven nothing yet: a bounded number of places, so that nobody can keep the others out by holding them.
//!
//! Who comes when there is no place takes that of the one who has waited longest, of the address that holds the most. So an address with many
//! pushes its own out, and whoever comes from one of his own is pushed out by nobody but as many other addresses as there are places.
//! Places are few: each operation looks at all of them.

use crate::limits::network_of;
use std::net::IpAddr;

/// A place that was taken; [`Waiting::leave`] gives it back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ticket(u64);

/// The places, oldest guest first.
#[derive(Debug)]
pub struct Waiting<T> {
    guests: Vec<(Ticket, IpAddr, T)>,
    places: usize,
    of_one: usize,
    next: u64,
}

impl<T> Waiting<T> {
    /// `places` in all, at most `of_one` for one address; at least one of each.
    pub fn new(places: usize, of_one: usize) -> Waiting<T> {
        let places = places.max(1);
        Waiting {
            guests: Vec::with_capacity(places),
            places,
            of_one: of_one.clamp(1, places),
            next: 0,
        }
    }

    /// How many wait.
    pub fn len(&self) -> usize {
        self.guests.len()
    }

    /// Whether nobody waits.
    pub fn is_empty(&self) -> bool {
        self.guests.is_empty()
    }

    /// Gives a place to a guest from `address`, and says who lost his for it.
    pub fn enter(&mut self, address: IpAddr, guest: T) -> (Ticket, Option<T>) {
        let address = network_of(address);
        let loser = match self.held_by(address) >= self.of_one {
            true => self.oldest_of(address),
            false if self.guests.len() >= self.places => self.oldest_of(self.busiest()),
            false => None,
        };
        let loser = loser.map(|place| self.guests.remove(place).2);
        let ticket = Ticket(self.next);
        self.next += 1;
        self.guests.push((ticket, address, guest));
        (ticket, loser)
    }

    /// Takes a guest out; `None` if he lost his place.
    pub fn leave(&mut self, ticket: Ticket) -> Option<T> {
        let place = self.guests.iter().position(|(of, ..)| *of == ticket)?;
        Some(self.guests.remove(place).2)
    }

    fn held_by(&self, address: IpAddr) -> usize {
        let held = self.guests.iter().filter(|(_, of, _)| *of == address);
        held.count()
    }

    fn oldest_of(&self, address: IpAddr) -> Option<usize> {
        self.guests.iter().position(|(_, of, _)| *of == address)
    }

    /// The address with the most guests; of several, that of the oldest guest.
    fn busiest(&self) -> IpAddr {
        let mut busiest = (0, IpAddr::from([0, 0, 0, 0]));
        for (_, address, _) in &self.guests {
            let held = self.held_by(*address);
            if held > busiest.0 {
                busiest = (held, *address);
            }
        }
        busiest.1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn host(number: u8) -> IpAddr {
        IpAddr::from([10, 0, 0, number])
    }

    #[test]
    fn a_crowd_of_one_address_pushes_out_itself_alone() {
        let mut waiting = Waiting::new(8, 6);
        let (device, _) = waiting.enter(host(1), "device");
        for _ in 0..1000 {
            let (_, loser) = waiting.enter(host(2), "crowd");
            assert!(loser.is_none_or(|loser| loser == "crowd"));
            let (_, loser) = waiting.enter(host(3), "crowd");
            assert!(loser.is_none_or(|loser| loser == "crowd"));
            assert!(waiting.len() <= 8);
        }
        assert_eq!(waiting.leave(device), Some("device"));
        assert_eq!(waiting.leave(device), None, "once");
    }

    #[test]
    fn the_oldest_goes_where_every_guest_has_an_address_of_his_own() {
        let mut waiting = Waiting::new(3, 3);
        for number in 0..3 {
            assert_eq!(waiting.enter(host(number), number).1, None);
        }
        assert_eq!(waiting.enter(host(9), 9).1, Some(0));
        assert_eq!(waiting.enter(host(8), 8).1, Some(1));
    }

    #[test]
    fn an_address_holds_no_more_than_its_share_of_a_house_that_is_not_full() {
        let mut waiting = Waiting::new(100, 2);
        let numbers: Vec<_> = (0..4).map(|n| waiting.enter(host(1), n).1).collect();
        assert_eq!(numbers, [None, None, Some(0), Some(1)]);
    }
}
