//! From the newest state to the tasks of a service, at its rate.

use std::sync::Arc;
use std::time::Duration;

use tokio::sync::watch;
use tokio::time::{Instant, MissedTickBehavior, interval};

use crate::feed::{Fresh, StateFeed};

/// A state that did not change is told again this often, so that both ends notice when the other is gone.
const REPEAT_PERIOD: Duration = Duration::from_secs(1);

impl StateFeed {
    /// Hands the newest state on at most `rate` times per second, until nobody listens any more; `each` sees every one that is
    /// handed on for the first time and makes of it what is handed on.
    pub(crate) async fn pump<T>(
        mut self,
        rate: f64,
        to: watch::Sender<Option<Arc<T>>>,
        mut each: impl FnMut(Fresh<'_>) -> T,
    ) {
        let mut ticks = interval(Duration::from_secs_f64(rate.recip()));
        ticks.set_missed_tick_behavior(MissedTickBehavior::Skip);
        let mut last_sent = Instant::now();
        loop {
            ticks.tick().await;
            if let Some(fresh) = self.fresh() {
                to.send_replace(Some(Arc::new(each(fresh))));
            } else if last_sent.elapsed() >= REPEAT_PERIOD {
                to.send_modify(|_| {});
            } else {
                continue;
            }
            last_sent = Instant::now();
        }
    }
}
