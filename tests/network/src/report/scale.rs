//! Rows of what one more client costs.

use taut_link::MulticastOptions;

use super::row::{Row, brief};
use super::sections::Extent;
use crate::bench::scale::{cost, ways};
use crate::bench::{BenchError, free_group};

/// Longest run, s.
const LONGEST: f64 = 5.0;
/// Half of a core at 1 kHz, µs for each state.
const HALF_A_CORE: f64 = 500.0;

pub(super) fn scale_rows(extent: &Extent) -> Result<Vec<Row>, BenchError> {
    let seconds = extent.seconds.min(LONGEST);
    let mut rows = Vec::new();
    for &clients in extent.clients {
        let ways = ways(clients)?;
        rows.push(Row::at_most(
            format!("one system call for {clients} datagrams, beside one for each"),
            ways.at_once / ways.one_by_one,
            1.0,
            "of the time",
            format!(
                "{} us a datagram, {} us one by one, sealing {} us",
                brief(ways.at_once),
                brief(ways.one_by_one),
                brief(ways.seal)
            ),
        ));
    }
    for &clients in extent.clients {
        let place = &extent.place;
        let unicast = cost(&extent.this, place, clients, None, seconds)?;
        rows.push(Row::at_most(
            format!("{clients} clients by unicast: broadcasting thread, a state"),
            unicast.state,
            HALF_A_CORE,
            "us",
            format!(
                "{} us for each client, {:.1} % sent, {} of {} lost",
                brief(unicast.each),
                unicast.sent * 100.0,
                unicast.lost,
                unicast.taken + unicast.lost
            ),
        ));
        let group = MulticastOptions {
            group: free_group(place.address())?,
            announced: None,
            interface: place.address(),
        };
        let multicast = cost(&extent.this, place, clients, Some(group), seconds)?;
        rows.push(Row::at_most(
            format!("{clients} clients by multicast: broadcasting thread, a state"),
            multicast.state,
            HALF_A_CORE,
            "us",
            format!(
                "{} of unicast's time, {} of {} lost",
                brief(multicast.state / unicast.state),
                multicast.lost,
                multicast.taken + multicast.lost
            ),
        ));
    }
    Ok(rows)
}
