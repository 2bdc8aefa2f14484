//! Ranks as threads of one process, with messages in memory: rank bugs are found without MPI.

use std::any::Any;
use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use crate::collective::{FailedElsewhere, Ranks, Transport};
use crate::{Communicator, Sums, ThreadsRefused, with_threads};

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

struct InProcess {
    rank: usize,
    shared: Arc<Shared>,
}

impl Transport for InProcess {
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

    fn receive(&self, from: usize, tag: u32, into: &mut Vec<u8>) -> bool {
        let mut mailbox = self.shared.mailbox(self.rank);
        loop {
            if self.shared.failed.load(Ordering::SeqCst) {
                return false;
            }
            if let Some(at) = mailbox.messages.iter().position(|m| m.from == from && m.tag == tag)
                && let Some(mut message) = mailbox.messages.remove(at)
            {
                std::mem::swap(into, &mut message.bytes);
                mailbox.spare.push(message.bytes);
                return true;
            }
            mailbox = self.shared.mailboxes[self.rank].1.wait(mailbox).unwrap_or_else(PoisonError::into_inner);
        }
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
    run_ranks_with(Sums::Ordered, ranks, threads_per_rank, program)
}

/// The same with sums in an order of choice.
///
/// # Errors
/// As [`run_ranks`].
pub fn run_ranks_with<T: Send>(
    sums: Sums,
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
                let communicator = Ranks::new(InProcess { rank, shared: Arc::clone(shared) }, sums);
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

/// Message of a panic.
pub(crate) fn message(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| payload.downcast_ref::<&str>().copied()).unwrap_or("no message").to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Reduction;

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

    /// A value of each rank whose sum depends on the order.
    fn addend(rank: usize) -> f64 {
        1e16_f64.powf((rank % 3) as f64 / 2.0) / (rank as f64 + 0.7)
    }

    #[test]
    fn reductions_agree_on_every_rank() {
        for ranks in 1..=9 {
            for sums in [Sums::Ordered, Sums::Tree] {
                let results = run_ranks_with(sums, ranks, 1, |c| {
                    let mut values = [addend(c.rank()), -(c.rank() as f64)];
                    c.all_reduce(&mut values, Reduction::Sum);
                    let mut extremes = [c.rank() as f64, if c.rank() == ranks / 2 { f64::NAN } else { 0.0 }];
                    c.all_reduce(&mut extremes, Reduction::Max);
                    let mut all = Vec::new();
                    c.all_gather(&vec![c.rank() as u8; 3 * c.rank() % 5], &mut all);
                    let mut told = vec![c.rank() as u8; c.rank() + 1];
                    c.broadcast(&mut told);
                    assert_eq!(told, [0]);
                    (values.map(f64::to_bits), extremes[0], extremes[1].is_nan(), all)
                })
                .unwrap();
                let all: Vec<Vec<u8>> = (0..ranks).map(|rank| vec![rank as u8; 3 * rank % 5]).collect();
                let count: f64 = (0..ranks).map(|rank| rank as f64).sum();
                for found in &results {
                    assert_eq!(*found, (results[0].0, (ranks - 1) as f64, true, all.clone()));
                    assert_eq!(f64::from_bits(found.0[1]), -count);
                }
                let in_order = (1..ranks).fold(addend(0), |sum, rank| sum + addend(rank));
                if sums == Sums::Ordered {
                    assert_eq!(results[0].0[0], in_order.to_bits(), "{ranks} ranks");
                }
            }
        }
    }

    /// Negative control: the order of a tree shows in the last digits.
    #[test]
    fn the_two_orders_differ() {
        let sum = |sums| {
            let sum = run_ranks_with(sums, 6, 1, |c| {
                let mut values = [addend(c.rank())];
                c.all_reduce(&mut values, Reduction::Sum);
                values[0]
            });
            sum.unwrap()[0]
        };
        let (ordered, tree) = (sum(Sums::Ordered), sum(Sums::Tree));
        assert!(ordered != tree && (ordered / tree - 1.0).abs() < 1e-14);
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
