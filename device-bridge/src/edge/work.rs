//! How much of a server's constraint sets a device loop can work on in its period.
//!
//! Rows, steps of the solver and rounds multiply: what a server may send could keep a loop of 1 kHz for tens of milliseconds, and a loop that is kept does
//! not lead a force down. So the time is divided beforehand, whatever the sets are: a quarter of a period for taking a set, which its rows decide, and a
//! quarter for the projections of a force. The rest is for the device and for being late.

use std::time::Duration;

/// Share of a period for each of the two.
const SHARE: u32 = 4;
/// Time to take one row of a set, and two and a half times what was measured: 40 us for 1024 rows (the method built with optimisation level 2).
const ROW: Duration = Duration::from_nanos(100);
/// Time to look at one row in one step of a projection, likewise: 20 us for 1024 rows, of which some ten steps are.
const VISIT: Duration = Duration::from_nanos(5);

/// Most rows of a set for a loop of this period: 2500 at 1 kHz, which is more than travel, 625 at 4 kHz.
pub(super) fn most_rows(period: Duration) -> usize {
    count(period, ROW) as usize
}

/// Most visits of rows in a step: 50,000 at 1 kHz, which are 48 steps of a projection on 1024 rows. An active set takes some 10.
pub(super) fn most_visits(period: Duration) -> u32 {
    count(period, VISIT)
}

fn count(period: Duration, each: Duration) -> u32 {
    u32::try_from(period.as_nanos() / u128::from(SHARE) / each.as_nanos()).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_faster_loop_has_less_time() {
        for (hz, rows, visits) in [
            (100, 25_000, 500_000),
            (1000, 2500, 50_000),
            (4000, 625, 12_500),
        ] {
            let period = Duration::from_secs(1) / hz;
            assert_eq!((most_rows(period), most_visits(period)), (rows, visits));
        }
    }
}
