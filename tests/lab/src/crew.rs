//! Work done side by side, its results in the order of the tasks: what comes out does not depend on who did what when.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread::{self, Builder};

/// As many threads as the machine runs at a time.
pub fn cores() -> usize {
    thread::available_parallelism().map_or(1, usize::from)
}

/// `work` of every task, on so many threads; each takes the next one that nobody has begun.
pub fn map<T: Sync, R: Send>(threads: usize, tasks: &[T], work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let next = AtomicUsize::new(0);
    let results: Vec<Mutex<Option<R>>> = tasks.iter().map(|_| Mutex::new(None)).collect();
    let take = || {
        while let Some(index) =
            Some(next.fetch_add(1, Ordering::Relaxed)).filter(|i| *i < tasks.len())
        {
            let result = work(&tasks[index]);
            *results[index].lock().expect("nobody panics with it") = Some(result);
        }
    };
    thread::scope(|scope| {
        for index in 1..threads.clamp(1, tasks.len().max(1)) {
            Builder::new()
                .name(format!("lab-{index}"))
                .spawn_scoped(scope, take)
                .expect("a thread can be started");
        }
        take();
    });
    let done = results.into_iter().map(|result| {
        let result = result.into_inner().expect("nobody panicked with it");
        result.expect("every task was taken")
    });
    done.collect()
}

#[cfg(test)]
mod tests {
    use super::map;

    #[test]
    fn results_are_in_the_order_of_the_tasks_whoever_does_them() {
        let tasks: Vec<u64> = (0..200).collect();
        // Some take much longer than others.
        let work = |task: &u64| (0..task % 7 * 10_000).fold(*task, |a, b| a ^ b.rotate_left(7));
        let alone = map(1, &tasks, work);
        for threads in [2, 3, 500] {
            assert_eq!(map(threads, &tasks, work), alone);
        }
        assert!(map(4, &[], work).is_empty());
    }
}
