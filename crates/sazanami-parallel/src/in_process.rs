//! Ranks as threads of one process, with messages in memory: rank bugs are found without MPI.

use std::any::Any;
use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use crate::{Communicator, Reduction, ThreadsRefused, with_threads};

const REDUCE_UP: u32 = u32::MAX;
const REDUCE_DOWN: u32 = u32::MAX - 1;
const GATHER: u32 = u32::MAX - 2;

/// A group of ranks failed.
#[derive(Debug)]
pub enum RanksFailed {
    /// There are not as many threads as the ranks need.
    Threads(ThreadsRefused),
    /// Some ranks panicked, upon which the others ended: rank and message of each panic.
    Panicked(Vec<(usize, String)>),
}

impl std::fmt::Display for RanksFailed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Threads(refused) => refused.fmt(f),
            Self::Panicked(panics) => {
                panics.iter().try_for_each(|(rank, message)| writeln!(f, "rank {rank} panicked: {message}"))
            }
        }
    }
}

impl std::error::Error for RanksFailed {}

struct Message {
    from: usize,
    tag: u32,
    bytes: Vec<u8>,
}

#[derive(Default)]
struct Mailbox {
    messages: VecDeque<Message>,
    spare: Vec<Vec<u8>>,
}

struct Shared {
    mailboxes: Vec<(Mutex<Mailbox>, Condvar)>,
    failed: AtomicBool,
}

impl Shared {
    fn mailbox(&self, rank: usize) -> MutexGuard<'_, Mailbox> {
        self.mailboxes[rank].0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn fail(&self) {
        self.failed.store(true, Ordering::SeqCst);
        for (mailbox, bell) in &self.mailboxes {
            // Taking the lock orders the flag before the wait of a rank that is about to sleep.
            drop(mailbox.lock().unwrap_or_else(PoisonError::into_inner));
            bell.notify_all();
        }
    }
}

/// Marks the panic of a rank that ended because another one had failed.
struct FailedElsewhere;

struct InProcess {
    rank: usize,
    shared: Arc<Shared>,
    scratch: Mutex<Vec<u8>>,
}

impl Communicator for InProcess {
    fn rank(&self) -> usize {
        self.rank
    }

    fn size(&self) -> usize {
        self.shared.mailboxes.len()
    }

    fn send(&self, to: usize, tag: u32, bytes: &[u8]) {
        let mut mailbox = self.shared.mailbox(to);
        let mut buffer = mailbox.spare.pop().unwrap_or_default();
        buffer.clear();
        buffer.extend_from_slice(bytes);
        mailbox.messages.push_back(Message { from: self.rank, tag, bytes: buffer });
        drop(mailbox);
        self.shared.mailboxes[to].1.notify_all();
    }

    fn receive(&self, from: usize, tag: u32, into: &mut Vec<u8>) {
        let mut mailbox = self.shared.mailbox(self.rank);
        loop {
            if self.shared.failed.load(Ordering::SeqCst) {
                drop(mailbox);
                // Without the words of a panic: the rank that failed says why.
                std::panic::resume_unwind(Box::new(FailedElsewhere));
            }
            if let Some(at) = mailbox.messages.iter().position(|m| m.from == from && m.tag == tag)
                && let Some(mut message) = mailbox.messages.remove(at)
            {
                std::mem::swap(into, &mut message.bytes);
                mailbox.spare.push(message.bytes);
                return;
            }
            mailbox = self.shared.mailboxes[self.rank].1.wait(mailbox).unwrap_or_else(PoisonError::into_inner);
        }
    }

    fn all_reduce(&self, values: &mut [f64], reduction: Reduction) {
        let mut bytes = self.scratch.lock().unwrap_or_else(PoisonError::into_inner);
        if self.rank == 0 {
            for from in 1..self.size() {
                self.receive(from, REDUCE_UP, &mut bytes);
                for (value, other) in values.iter_mut().zip(bytemuck::cast_slice_iter(&bytes)) {
                    *value = reduction.combine(*value, other);
                }
            }
            for to in 1..self.size() {
                self.send(to, REDUCE_DOWN, bytemuck::cast_slice(values));
            }
        } else {
            self.send(0, REDUCE_UP, bytemuck::cast_slice(values));
            self.receive(0, REDUCE_DOWN, &mut bytes);
            for (value, other) in values.iter_mut().zip(bytemuck::cast_slice_iter(&bytes)) {
                *value = other;
            }
        }
    }

    fn all_gather(&self, mine: &[u8], all: &mut Vec<Vec<u8>>) {
        all.resize(self.size(), Vec::new());
        for to in (0..self.size()).filter(|&to| to != self.rank) {
            self.send(to, GATHER, mine);
        }
        for (from, bytes) in all.iter_mut().enumerate() {
            if from == self.rank {
                bytes.clear();
                bytes.extend_from_slice(mine);
            } else {
                self.receive(from, GATHER, bytes);
            }
        }
    }
}

mod bytemuck {
    pub(super) use ::bytemuck::cast_slice;

    /// Reads `f64` values from bytes of any alignment.
    pub(super) fn cast_slice_iter(bytes: &[u8]) -> impl Iterator<Item = f64> + '_ {
        bytes.chunks_exact(8).map(::bytemuck::pod_read_unaligned)
    }
}

/// Runs `program` once per rank, each rank on its own thread with its own pool of
/// `threads_per_rank` threads, and returns the results by rank.
///
/// # Errors
/// [`RanksFailed`] if there are too few threads, or if a rank panics; the other ranks end at their next wait.
pub fn run_ranks<T: Send>(
    ranks: usize,
    threads_per_rank: usize,
    program: impl Fn(Box<dyn Communicator>) -> T + Sync,
) -> Result<Vec<T>, RanksFailed> {
    let shared = Arc::new(Shared {
        mailboxes: (0..ranks).map(|_| Default::default()).collect(),
        failed: AtomicBool::new(false),
    });
    let (program, shared) = (&program, &shared);
    let outcomes: Vec<_> = std::thread::scope(|scope| {
        let start = |rank| {
            let run = move || {
                let communicator = InProcess { rank, shared: Arc::clone(shared), scratch: Mutex::default() };
                let work = || with_threads(threads_per_rank, || program(Box::new(communicator)));
                let outcome = catch_unwind(AssertUnwindSafe(work));
                if !matches!(outcome, Ok(Ok(_))) {
                    shared.fail();
                }
                outcome
            };
            let handle = std::thread::Builder::new().spawn_scoped(scope, run);
            handle.inspect_err(|_| shared.fail())
        };
        let handles: Vec<_> = (0..ranks).map(start).collect();
        let refused = |reason| Ok(Err(ThreadsRefused::new(ranks, &reason)));
        handles.into_iter().map(|h| h.map_or_else(refused, |h| h.join().and_then(|outcome| outcome))).collect()
    });
    let mut results = Vec::with_capacity(ranks);
    let mut panics = Vec::new();
    for (rank, outcome) in outcomes.into_iter().enumerate() {
        match outcome {
            Ok(Ok(value)) => results.push(value),
            Ok(Err(refused)) => return Err(RanksFailed::Threads(refused)),
            Err(payload) if payload.is::<FailedElsewhere>() => {}
            Err(payload) => panics.push((rank, message(payload.as_ref()))),
        }
    }
    if results.len() == ranks { Ok(results) } else { Err(RanksFailed::Panicked(panics)) }
}

/// What a panic says.
fn message(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| payload.downcast_ref::<&str>().copied()).unwrap_or("no message").to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_with_one_tag_keep_their_order() {
        let sums = run_ranks(3, 1, |c| {
            let next = (c.rank() + 1) % c.size();
            let previous = (c.rank() + c.size() - 1) % c.size();
            c.send(next, 1, &[c.rank() as u8]);
            c.send(next, 1, &[c.rank() as u8 + 10]);
            c.send(next, 2, &[99]);
            let mut bytes = Vec::new();
            c.receive(previous, 2, &mut bytes);
            assert_eq!(bytes, [99]);
            c.receive(previous, 1, &mut bytes);
            let first = bytes[0];
            c.receive(previous, 1, &mut bytes);
            (first, bytes[0])
        })
        .unwrap();
        assert_eq!(sums, [(2, 12), (0, 10), (1, 11)]);
    }

    #[test]
    fn reductions_agree_on_every_rank() {
        let results = run_ranks(4, 2, |c| {
            let mut values = [c.rank() as f64, -(c.rank() as f64)];
            c.all_reduce(&mut values, Reduction::Sum);
            let mut largest = [c.rank() as f64];
            c.all_reduce(&mut largest, Reduction::Max);
            let mut all = Vec::new();
            c.all_gather(&vec![7; c.rank()], &mut all);
            (values, largest[0], all.iter().map(Vec::len).collect::<Vec<_>>())
        })
        .unwrap();
        assert!(results.iter().all(|r| *r == ([6.0, -6.0], 3.0, vec![0, 1, 2, 3])));
    }

    #[test]
    fn a_panic_on_one_rank_ends_all() {
        let outcome = run_ranks(3, 1, |c| {
            assert_ne!(c.rank(), 1, "the sand ran out");
            let mut bytes = Vec::new();
            c.receive(1, 0, &mut bytes);
        });
        let Err(RanksFailed::Panicked(panics)) = outcome else { panic!("a rank panicked") };
        assert_eq!(panics.len(), 1);
        assert!(panics[0].0 == 1 && panics[0].1.contains("the sand ran out"));
    }
}
