//! Work and span of parallel loops: how much of a piece of work could run side by side.

use std::cell::{Cell, RefCell};
use std::panic::Location;

/// Work outside all parallel loops before one of them.
#[derive(Clone, Copy, Debug)]
pub struct SerialSection {
    /// The loop that ends it.
    pub before: &'static Location<'static>,
    /// Time \[s].
    pub time: f64,
}

/// An outermost parallel loop, or a fork of two tasks.
#[derive(Clone, Copy, Debug)]
pub struct ParallelLoop {
    /// Place of its call.
    pub at: &'static Location<'static>,
    /// Time on one thread \[s].
    pub work: f64,
    /// Time on as many threads as there are tasks: the longest chain of tasks that wait for one another \[s].
    pub span: f64,
    /// Tasks that it is cut into.
    pub tasks: usize,
}

/// Work and span of what ran on one thread, after the scalability analyser of He, Leiserson and Leiserson (2010,
/// SPAA, 145-156).
#[derive(Clone, Debug, Default)]
pub struct WorkAndSpan {
    /// Time \[s].
    pub work: f64,
    /// Outermost parallel loops, in order.
    pub loops: Vec<ParallelLoop>,
    /// Work between them, in order; the last section, which no loop ends, is in the total alone.
    pub serial: Vec<SerialSection>,
}

impl WorkAndSpan {
    /// Time outside all parallel loops \[s].
    #[must_use]
    pub fn serial_time(&self) -> f64 {
        self.work - self.loops.iter().map(|l| l.work).sum::<f64>()
    }
}

thread_local! {
    /// Threads that a recording is for; 0: nothing is recorded.
    static AS_OF: Cell<usize> = const { Cell::new(0) };
    static RECORD: RefCell<Option<Record>> = const { RefCell::new(None) };
}

struct Record {
    /// Time that has passed \[s].
    clock: fn() -> f64,
    begin: f64,
    /// End of the last outermost loop.
    since: f64,
    /// Forks that are open.
    depth: usize,
    /// Time in which branches that could have run beside longer ones ran instead one after another \[s].
    spared: f64,
    tasks: usize,
    found: WorkAndSpan,
}

/// Records the parallel loops of `work`, which runs on the pool of one thread that calls this, cut as on `threads`
/// threads, by a `clock` in seconds.
///
/// Work in another pool within `work` counts as serial.
///
/// # Panics
/// If more than one thread would take part, or within another recording.
pub fn work_and_span<T>(threads: usize, clock: fn() -> f64, work: impl FnOnce() -> T) -> (T, WorkAndSpan) {
    assert_eq!(rayon::current_num_threads(), 1, "loops are recorded on one thread");
    assert!(recorded_threads().is_none(), "a recording within another");
    let begin = clock();
    let record = Record { clock, begin, since: begin, depth: 0, spared: 0.0, tasks: 0, found: WorkAndSpan::default() };
    RECORD.set(Some(record));
    AS_OF.set(threads.max(1));
    let recording = Recording;
    let result = work();
    let end = clock();
    let found = RECORD.take().map(|record| WorkAndSpan { work: end - record.begin, ..record.found });
    drop(recording);
    (result, found.unwrap_or_default())
}

/// Ends the recording on this thread, also where the work panics.
struct Recording;

impl Drop for Recording {
    fn drop(&mut self) {
        AS_OF.set(0);
        RECORD.set(None);
    }
}

/// Threads that a recording on this thread is for, if there is one.
pub(crate) fn recorded_threads() -> Option<usize> {
    Some(AS_OF.get()).filter(|&threads| threads > 0)
}

/// Runs an outermost loop, or one within another; records it if a recording is on.
pub(crate) fn in_loop<T>(at: &'static Location<'static>, body: impl FnOnce() -> T) -> T {
    if AS_OF.get() == 0 {
        return body();
    }
    let begin = now();
    let outermost = with_record(|record| {
        record.depth += 1;
        if record.depth == 1 {
            let time = begin - record.since;
            record.found.serial.push(SerialSection { before: at, time });
            (record.spared, record.tasks) = (0.0, 1);
        }
        record.depth == 1
    });
    let result = body();
    with_record(|record| {
        record.depth -= 1;
        if outermost {
            record.since = (record.clock)();
            let work = record.since - begin;
            record.found.loops.push(ParallelLoop { at, work, span: work - record.spared, tasks: record.tasks });
        }
        outermost
    });
    result
}

/// Runs two tasks one after the other, and records how much of them could have run side by side.
pub(crate) fn fork<A, B>(a: impl FnOnce() -> A, b: impl FnOnce() -> B) -> (A, B) {
    let spared = || RECORD.with_borrow(|record| record.as_ref().map_or(0.0, |record| record.spared));
    let (begin, before) = (now(), spared());
    let first = a();
    let (middle, between) = (now(), spared());
    let second = b();
    let (end, after) = (now(), spared());
    let spans = [middle - begin - (between - before), end - middle - (after - between)];
    with_record(|record| {
        record.spared += spans[0].min(spans[1]);
        record.tasks += 1;
        true
    });
    (first, second)
}

/// Time by the clock of the recording; 0 without one \[s].
fn now() -> f64 {
    RECORD.with_borrow(|record| record.as_ref().map_or(0.0, |record| (record.clock)()))
}

fn with_record(change: impl FnOnce(&mut Record) -> bool) -> bool {
    RECORD.with_borrow_mut(|record| record.as_mut().is_some_and(change))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{for_each_chunk, sum_over, with_threads};

    thread_local! {
        static CLOCK: Cell<f64> = const { Cell::new(0.0) };
    }

    fn clock() -> f64 {
        CLOCK.get()
    }

    fn busy(seconds: f64) {
        CLOCK.set(clock() + seconds);
    }

    fn record(work: impl FnOnce() + Send) -> WorkAndSpan {
        with_threads(1, || work_and_span(64, clock, work).1).unwrap()
    }

    #[test]
    fn loops_are_told_from_what_runs_between_them() {
        let mut a = [0; 16];
        let found = record(|| {
            busy(4.0);
            for_each_chunk(&mut a[..], 1, |_, _| busy(1.0));
            busy(2.0);
            assert_eq!(sum_over(3, |_| [1.0]), [3.0]);
            busy(0.5);
        });
        assert_eq!(
            found.loops.iter().map(|l| (l.work, l.span, l.tasks)).collect::<Vec<_>>(),
            [(16.0, 1.0, 16), (0.0, 0.0, 3)]
        );
        assert_eq!(found.serial.iter().map(|s| s.time).collect::<Vec<_>>(), [4.0, 2.0]);
        assert_eq!((found.work, found.serial_time()), (22.5, 6.5));
    }

    #[test]
    fn one_long_task_is_the_span() {
        let mut a = [0; 8];
        let long = |n: usize| busy(if n == 3 { 16.0 } else { 0.5 });
        let spans = |chunk| record(|| for_each_chunk(&mut a[..], chunk, |n, _| long(n))).loops[0].span;
        assert_eq!([1, 8].map(spans), [16.0, 0.5]);
    }

    #[test]
    fn what_a_fork_leaves_to_one_thread_is_in_its_span() {
        // Two halves of 3 and 5, of which the second is a loop of five, and a seam of 1 within the first.
        let mut a = [0; 5];
        let found = record(|| {
            crate::join(
                || {
                    crate::join(|| busy(1.0), || busy(1.0));
                    busy(1.0);
                },
                || for_each_chunk(&mut a[..], 1, |_, _| busy(1.0)),
            );
        });
        assert_eq!(found.loops.len(), 1);
        assert_eq!((found.loops[0].work, found.loops[0].span, found.loops[0].tasks), (8.0, 2.0, 7));
    }

    #[test]
    fn nothing_is_recorded_without_being_asked() {
        let mut a = [0; 8];
        with_threads(1, || {
            for_each_chunk(&mut a[..], 1, |_, _| ());
            assert!(RECORD.with_borrow(Option::is_none) && recorded_threads().is_none());
            // Nor after work that panics.
            let broken = std::panic::catch_unwind(|| work_and_span(8, clock, || panic!("as asked")));
            assert!(broken.is_err() && RECORD.with_borrow(Option::is_none) && recorded_threads().is_none());
        })
        .unwrap();
    }
}
