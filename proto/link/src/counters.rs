//! What happened on the network, counted: nothing unexpected is silent.

use std::sync::atomic::{AtomicU64, Ordering};

macro_rules! counters {
    ($(#[$doc:meta])* $name:ident, $cells:ident { $($(#[$field_doc:meta])* $field:ident),* $(,)? }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        pub struct $name { $($(#[$field_doc])* pub $field: u64,)* }

        impl $name {
            /// All, by name.
            #[must_use]
            pub fn named(&self) -> Vec<(&'static str, u64)> {
                vec![$((stringify!($field), self.$field),)*]
            }
        }

        #[derive(Debug, Default)]
        pub(crate) struct $cells { $(pub(crate) $field: Cell,)* }

        impl $cells {
            pub(crate) fn read(&self) -> $name {
                $name { $($field: self.$field.get(),)* }
            }
        }
    };
}

/// One counter that any thread may raise.
#[derive(Debug, Default)]
pub(crate) struct Cell(AtomicU64);

impl Cell {
    pub(crate) fn add(&self, count: u64) {
        self.0.fetch_add(count, Ordering::Relaxed);
    }

    pub(crate) fn one(&self) {
        self.add(1);
    }

    /// One less, where something counted as lost turns up late.
    pub(crate) fn take_one(&self) {
        let _ = self
            .0
            .fetch_update(Ordering::Relaxed, Ordering::Relaxed, |count| {
                count.checked_sub(1)
            });
    }

    pub(crate) fn get(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }
}

counters! {
    /// Counts of the server since it started.
    Counters, CounterCells {
        /// Datagrams sent to clients.
        packets_sent,
        /// Bytes of these.
        bytes_sent,
        /// Datagrams that the system or QUIC did not take; the client sees a gap.
        send_errors,
        /// Times that the way to a client was full: its rate is lowered for a while.
        congested,
        /// Datagrams sent to the multicast group.
        multicast_sent,
        /// States that could not be encoded (a number that is not finite): nobody got them.
        encode_errors,
        /// Authentic datagrams received.
        packets_received,
        /// Datagrams that are not of taut at all.
        garbage,
        /// Datagrams and Hellos of another protocol version.
        wrong_version,
        /// Datagrams whose seal is broken, or of no session.
        forged,
        /// Authentic datagrams seen before.
        replayed,
        /// Device readings taken.
        inputs,
        /// Device readings refused: the session is not the device's.
        inputs_refused,
        /// Device readings overtaken by newer ones.
        inputs_late,
        /// Readings of the viewer's head taken.
        heads,
        /// Readings of the viewer's head refused: no pose, or overtaken.
        heads_refused,
        /// Wrenches from outside taken.
        forces,
        /// Wrenches from outside refused: no number of a wrench in its range, or overtaken.
        forces_refused,
        /// Wrenches from outside that never came, by the gaps of their numbers.
        forces_lost,
        /// Clients let in.
        joined,
        /// Clients refused, for whatever reason.
        refused,
        /// Clients refused for the wrong key.
        wrong_key,
        /// Clients whose session was closed because they were silent.
        evicted,
        /// Control messages that were read later than they came, because there were too many.
        control_delayed,
        /// Clients refused because their credential is revoked or their role closed.
        shut_out,
        /// Attempts to join that were turned away before TLS: too many, too soon after wrong proofs, or too many at once.
        turned_away,
        /// First packets of addresses that had to prove that they receive: one of each join, and those of forged addresses.
        address_checks,
        /// Attempts to join that lost their place to somebody else's before they had proven anything.
        crowded_out,
        /// Challenges sent to addresses that clients seem to have moved to.
        path_challenges,
        /// What clients tried that their role may not.
        forbidden,
        /// Datagrams dropped unopened: of unknown sources beyond their rate, or of a client beyond its.
        flooded,
        /// Events dropped because nobody took them.
        events_dropped,
    }
}

counters! {
    /// Counts of a client since it joined.
    ClientCounters, ClientCounterCells {
        /// Authentic datagrams received, but for those of other members.
        packets_received,
        /// States received.
        states,
        /// Datagrams missing in the sequence.
        lost,
        /// Datagrams seen before.
        duplicates,
        /// States overtaken by newer ones, not delivered.
        late,
        /// States dropped because nobody took them from the queue.
        overrun,
        /// Datagrams that are not of taut, or that make no sense.
        garbage,
        /// Datagrams of another protocol version.
        wrong_version,
        /// Datagrams whose seal is broken.
        forged,
        /// Constraint sets that became whole.
        sets,
        /// Datagrams of other members: no sign of the server.
        from_members,
        /// Datagrams heard from the multicast group.
        multicast_heard,
        /// Times that the multicast group fell silent and states came by unicast again.
        multicast_lost,
        /// Times that a member was found to forge the server's states.
        states_forged,
        /// Times that the group was left because the server did not confirm what came by it.
        states_unconfirmed,
        /// Datagrams sent.
        packets_sent,
        /// Datagrams that the system did not take.
        send_errors,
    }
}

counters! {
    /// Where a client's meshes came from since it was started, over all its sessions.
    MeshCounters, MeshCounterCells {
        /// Meshes fetched from the server.
        fetched,
        /// Bytes of these.
        fetched_bytes,
        /// Meshes read from the cache on disk.
        from_cache,
        /// Bytes of these.
        cache_bytes,
        /// Files of the cache that were damaged, and removed.
        damaged,
        /// Meshes that the cache could not keep.
        not_kept,
    }
}
