//! Captures several at a time; what comes out is in their order, and the same as one after another.

use crate::failure::{Failure, INTERNAL};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// Stack of a thread: what the main thread of a program has on Linux, since plugins run on it.
const STACK_BYTES: usize = 8 << 20;

/// `work` on every index below `count`, `jobs` of them at a time. After the first failure, that of the lowest index is
/// returned and nothing more is begun.
pub fn in_order<T: Send>(
    count: usize,
    jobs: usize,
    work: impl Fn(usize) -> Result<T, Failure> + Sync,
) -> Result<Vec<T>, Failure> {
    if jobs <= 1 {
        return (0..count).map(work).collect();
    }
    let next = AtomicUsize::new(0);
    let done: Mutex<Vec<(usize, Result<T, Failure>)>> = Mutex::default();
    let worker = || {
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            if index >= count {
                return;
            }
            let result = work(index);
            if result.is_err() {
                next.fetch_max(count, Ordering::Relaxed);
            }
            done.lock().unwrap_or_else(PoisonError::into_inner).push((index, result));
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..jobs.min(count) {
            let thread = std::thread::Builder::new().stack_size(STACK_BYTES);
            thread
                .spawn_scoped(scope, worker)
                .map_err(|error| Failure::new(INTERNAL, anyhow::anyhow!("a thread for captures: {error}")))?;
        }
        Ok::<_, Failure>(())
    })?;
    let mut done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    done.sort_by_key(|(index, _)| *index);
    done.into_iter().map(|(_, result)| result).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn results_come_in_order_whoever_is_done_first() {
        let slow_at_first = |index: usize| {
            std::thread::sleep(Duration::from_millis(20 - 2 * index as u64));
            Ok(index * index)
        };
        for jobs in [1, 3, 64] {
            assert_eq!(in_order(8, jobs, slow_at_first).unwrap(), [0, 1, 4, 9, 16, 25, 36, 49], "{jobs} jobs");
        }
        assert!(in_order(0, 4, Ok).unwrap().is_empty());
    }

    #[test]
    fn the_failure_of_the_first_in_order_is_told_and_nothing_more_is_begun() {
        let begun = AtomicUsize::new(0);
        let wrong = |index: usize| {
            begun.fetch_add(1, Ordering::Relaxed);
            if index == 2 {
                std::thread::sleep(Duration::from_millis(30));
            }
            if index >= 2 { Err(Failure::input(format!("capture {index}"))) } else { Ok(()) }
        };
        assert_eq!(in_order(100, 2, wrong).unwrap_err().to_string(), "capture 2");
        assert!(begun.load(Ordering::Relaxed) <= 5);
    }
}
