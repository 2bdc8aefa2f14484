//! Pictures are drawn on a thread of their own, beside the steps.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, SendError, Sender, SyncSender, channel, sync_channel};
use std::thread::{Builder, JoinHandle};

use sazanami_parallel::with_threads;

use crate::artist::NotDrawn;

/// Draws and saves the pictures of one time, from data of its own.
type Task = Box<dyn FnOnce() -> Result<(), NotDrawn> + Send>;

/// Sets of pictures that wait to be drawn before the run waits for them.
const QUEUE: usize = 4;

/// A bounded queue of pictures and the thread that draws them in its order. Nothing that goes wrong in drawing ends a
/// run: it is kept for [`Drawing::failures`].
pub(crate) struct Drawing {
    threads: usize,
    worker: Option<(SyncSender<Task>, JoinHandle<()>)>,
    failed: (Sender<String>, Receiver<String>),
}

impl Drawing {
    /// An empty queue; its thread begins with the first picture and shares the loops of a picture among `threads`.
    pub fn new(threads: usize) -> Self {
        Self { threads, worker: None, failed: channel() }
    }

    /// Puts pictures into the queue; waits while it is full.
    pub fn add(&mut self, task: impl FnOnce() -> Result<(), NotDrawn> + Send + 'static) {
        if self.worker.is_none() {
            self.worker = self.start();
        }
        let sent = match &self.worker {
            Some((queue, _)) => queue.send(Box::new(task)),
            None => Err(SendError(Box::new(task) as Task)),
        };
        // Without a thread the run draws by itself.
        if let Err(SendError(task)) = sent {
            perform(task, &self.failed.0);
        }
    }

    /// Starts the thread; none if the system refuses it.
    fn start(&self) -> Option<(SyncSender<Task>, JoinHandle<()>)> {
        let (queue, tasks) = sync_channel::<Task>(QUEUE);
        let (threads, failures) = (self.threads, self.failed.0.clone());
        let draw_all = move || {
            // Refused threads drop the queue: what is added later is drawn by the run.
            let outcome = with_threads(threads, || tasks.into_iter().for_each(|task| perform(task, &failures)));
            if let Err(refused) = outcome {
                let _ = failures.send(refused.to_string());
            }
        };
        Builder::new().name("pictures".into()).spawn(draw_all).ok().map(|thread| (queue, thread))
    }

    /// Waits until everything in the queue is drawn.
    pub fn finish(&mut self) {
        if let Some((queue, thread)) = self.worker.take() {
            drop(queue);
            // The thread catches what its tasks panic with.
            let _ = thread.join();
        }
    }

    /// Failures since the last call, a sentence each.
    pub fn failures(&self) -> impl Iterator<Item = String> {
        self.failed.1.try_iter()
    }
}

impl Drop for Drawing {
    fn drop(&mut self) {
        // A run that breaks off does not wait for its pictures.
        if !std::thread::panicking() {
            self.finish();
        }
    }
}

/// Draws; what goes wrong is sent to `failures`, whose receiver outlives the thread.
fn perform(task: Task, failures: &Sender<String>) {
    let problem = match catch_unwind(AssertUnwindSafe(task)) {
        Ok(Ok(())) => return,
        Ok(Err(error)) => error.to_string(),
        Err(_) => "drawing broke off: this is a fault of the program, please report it with the case".to_owned(),
    };
    let _ = failures.send(problem);
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::sync::{Arc, Barrier};

    use super::*;

    #[test]
    fn everything_is_drawn_in_order_before_the_end() {
        let (sender, order) = channel();
        let mut drawing = Drawing::new(2);
        for n in 0..3 * QUEUE {
            let sender = sender.clone();
            drawing.add(move || {
                sender.send(n).expect("the test listens");
                Ok(())
            });
        }
        drawing.finish();
        assert_eq!(order.try_iter().collect::<Vec<_>>(), (0..3 * QUEUE).collect::<Vec<_>>());
        assert_eq!(drawing.failures().count(), 0);
    }

    #[test]
    fn the_run_goes_on_while_a_picture_is_drawn() {
        let (gate, drawn) = (Arc::new(Barrier::new(2)), Arc::new(AtomicUsize::new(0)));
        let mut drawing = Drawing::new(1);
        let (held, count) = (gate.clone(), drawn.clone());
        drawing.add(move || {
            held.wait();
            count.fetch_add(1, Ordering::SeqCst);
            Ok(())
        });
        // Drawn at once, `add` would not return before the gate opens.
        assert_eq!(drawn.load(Ordering::SeqCst), 0);
        gate.wait();
        drop(drawing);
        assert_eq!(drawn.load(Ordering::SeqCst), 1, "a queue that is dropped is drawn to its end");
    }

    #[test]
    fn failures_and_panics_are_reported_and_the_next_picture_is_drawn() {
        let mut drawing = Drawing::new(1);
        drawing.add(|| Err("nothing to show of V [mm³]".into()));
        drawing.add(|| panic!("on purpose"));
        let drawn = Arc::new(AtomicUsize::new(0));
        let count = drawn.clone();
        drawing.add(move || {
            count.fetch_add(1, Ordering::SeqCst);
            Ok(())
        });
        drawing.finish();
        let failures: Vec<String> = drawing.failures().collect();
        assert_eq!(failures.len(), 2, "{failures:?}");
        assert!(failures[0].contains("V [mm³]") && failures[1].contains("broke off"), "{failures:?}");
        assert_eq!(drawn.load(Ordering::SeqCst), 1);
    }
}
