//! Ranks that exchange messages, and threads inside a rank.
//!
//! This is the only crate that names a thread pool. Ranks are threads of one process, or the processes of a launcher, whose
//! messages a [`Transport`] carries. Physics sees [`Communicator`] behind a domain, and the loops of this crate, which give the same bits for
//! any number of threads: work is cut into chunks whose size depends on the problem alone, every
//! chunk writes only its own part, and sums follow a binary tree over the chunks.
//!
//! A sum has the same bits for any number of threads:
//!
//! ```
//! use sazanami_parallel::{sum_over, with_threads};
//!
//! let sum = || sum_over(1000, |i| [1.0 / (i as f64 + 0.3)]);
//! assert_eq!(with_threads(1, sum).unwrap(), with_threads(3, sum).unwrap());
//! ```

mod collective;
mod communicator;
mod in_process;
mod launch;
mod loops;
mod reduction;
mod solo;
mod work_and_span;

pub use collective::Transport;
pub use communicator::{Communicator, Reduction, Sums};
pub use in_process::{RanksFailed, run_ranks, run_ranks_with};
pub use launch::{JoinError, Launcher, Processes, Session, World};
pub use loops::{Rows, SlicesMut, ThreadsRefused, for_each_chunk, join, number_of_threads, with_threads};
pub use reduction::{max_over, reduce_over, sum_over};
pub use solo::Solo;
pub use work_and_span::{ParallelLoop, SerialSection, WorkAndSpan, work_and_span};
