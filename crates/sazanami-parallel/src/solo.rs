//! The group of one rank.

use std::collections::VecDeque;
use std::sync::{Mutex, PoisonError};

use crate::{Communicator, Reduction};

/// A single rank: nothing leaves the process, reductions are the identity.
#[derive(Debug, Default)]
pub struct Solo {
    to_self: Mutex<VecDeque<(u32, Vec<u8>)>>,
}

impl Communicator for Solo {
    fn rank(&self) -> usize {
        0
    }

    fn size(&self) -> usize {
        1
    }

    fn send(&self, to: usize, tag: u32, bytes: &[u8]) {
        assert_eq!(to, 0, "a single rank can send to itself only");
        self.to_self.lock().unwrap_or_else(PoisonError::into_inner).push_back((tag, bytes.to_vec()));
    }

    fn receive(&self, from: usize, tag: u32, into: &mut Vec<u8>) {
        assert_eq!(from, 0, "a single rank can receive from itself only");
        let mut queue = self.to_self.lock().unwrap_or_else(PoisonError::into_inner);
        let at = queue.iter().position(|(t, _)| *t == tag).expect("a single rank receives what it has sent before");
        if let Some((_, bytes)) = queue.remove(at) {
            *into = bytes;
        }
    }

    fn broadcast(&self, _bytes: &mut Vec<u8>) {}

    fn all_reduce(&self, _values: &mut [f64], _reduction: Reduction) {}

    fn all_gather(&self, mine: &[u8], all: &mut Vec<Vec<u8>>) {
        all.resize(1, Vec::new());
        all[0].clear();
        all[0].extend_from_slice(mine);
    }
}
