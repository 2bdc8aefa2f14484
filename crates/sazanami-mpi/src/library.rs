//! Messages of an MPI library.
//!
//! Only messages between two ranks are taken from it; what all ranks do together is built on them in `sazanami-parallel`, so
//! that the bits are those of ranks within one process. Waits look out for ranks that have failed.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use ferrompi::{PersistentRequest, Source, Tag, ThreadLevel};
use sazanami_parallel::{JoinError, Launcher, Processes, Session, Transport, World};

/// Tag of the message that a rank has failed.
const FAILURE: i32 = 0;
/// Rounds of attempts, some 10 us each, for which a wait keeps the processor. Then it sleeps between them, as long as
/// this at first and at most, twice as long after each [`ALIKE`] naps. It never yields instead: a busy machine would
/// take the processor for milliseconds.
const AWAKE: usize = 20;
const NAPS: [Duration; 2] = [Duration::from_micros(20), Duration::from_millis(2)];
const ALIKE: usize = 64;
/// Attempts to receive between two looks at other things.
const ATTEMPTS: usize = 64;
/// Memory of a message that is kept for the next ones \[bytes]; larger ones, of whole fields, are rare.
const KEPT: usize = 16 << 20;

/// Starts MPI and meets the other processes.
pub fn join(launcher: Launcher) -> Result<World, JoinError> {
    let not_started = |error: ferrompi::Error| JoinError::NotStarted(error.to_string());
    let library = ferrompi::Mpi::init_thread(ThreadLevel::Serialized).map_err(not_started)?;
    if library.thread_level() < ThreadLevel::Serialized {
        return Err(JoinError::NotStarted("the library allows calls on its main thread only".into()));
    }
    let world = library.world();
    let (size, rank) = (world.size() as usize, world.rank() as usize);
    if launcher.size.is_some_and(|started| started != size) || launcher.rank.is_some_and(|number| number != rank) {
        return Err(JoinError::OtherWorld { launcher, size, rank, library: name() });
    }
    // Three groups, so that messages of the work, about the work and of failures never meet.
    let group = || world.duplicate().map_err(not_started);
    let shared = Shared { notices: group()?, failure: Mutex::default() };
    let session = MpiSession { groups: [Arc::new(group()?), Arc::new(group()?)], shared: Arc::new(shared) };
    Ok(World::new(Processes::of(Arc::new(session)), Box::new(library)))
}

/// Name and version of the MPI library, on one line.
pub fn name() -> String {
    let text = ferrompi::Mpi::library_version().unwrap_or_else(|error| error.to_string());
    let name = text.lines().next().unwrap_or_default().split(',').next().unwrap_or_default();
    // MPICH has a tab in its name.
    name.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Failures that ranks tell one another of.
struct Shared {
    notices: ferrompi::Communicator,
    failure: Mutex<Option<(usize, String)>>,
}

impl Shared {
    fn known(&self) -> MutexGuard<'_, Option<(usize, String)>> {
        self.failure.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Looks for news of a failure.
    fn hear(&self) -> Result<bool, ferrompi::Error> {
        let Some((message, status)) = self.notices.improbe::<u8>(Source::Any, FAILURE)? else {
            return Ok(self.known().is_some());
        };
        let mut reason = vec![0; status.count.unwrap_or_default()];
        message.mrecv(&mut reason)?;
        if let Source::Rank(rank) = status.source {
            self.known().get_or_insert((rank as usize, String::from_utf8_lossy(&reason).into_owned()));
        }
        Ok(true)
    }
}

struct MpiSession {
    /// For the work, and for messages about it.
    groups: [Arc<ferrompi::Communicator>; 2],
    shared: Arc<Shared>,
}

impl Session for MpiSession {
    fn transport(&self, control: bool) -> Box<dyn Transport> {
        let group = Arc::clone(&self.groups[usize::from(control)]);
        Box::new(Mpi { group, shared: Arc::clone(&self.shared), sends: Mutex::default() })
    }

    fn fail(&self, reason: &str) {
        let notices = &self.shared.notices;
        self.shared.known().get_or_insert((notices.rank() as usize, reason.to_owned()));
        for rank in (0..notices.size()).filter(|&rank| rank != notices.rank()) {
            // Short enough to leave without a receiver; where it does not, this rank ends the job by itself.
            let sent = notices.send_init(reason.as_bytes().to_vec(), rank, FAILURE);
            if let Ok(mut sent) = sent
                && sent.start().is_ok()
            {
                let _ = sent.test();
                std::mem::forget(sent);
            }
        }
    }

    fn failure(&self) -> Option<(usize, String)> {
        self.shared.known().clone()
    }

    fn abort(&self, code: u8) -> ! {
        self.shared.notices.abort(i32::from(code))
    }

    fn library(&self) -> String {
        name()
    }

    fn host(&self) -> String {
        self.shared.notices.processor_name().unwrap_or_default()
    }
}

/// Messages on their way, and memory of those that have left.
#[derive(Default)]
struct Sends {
    under_way: Vec<PersistentRequest<u8>>,
    spare: Vec<Vec<u8>>,
}

struct Mpi {
    group: Arc<ferrompi::Communicator>,
    shared: Arc<Shared>,
    sends: Mutex<Sends>,
}

impl Mpi {
    fn sends(&self) -> MutexGuard<'_, Sends> {
        self.sends.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Keeps the memory of messages that have left.
    fn reap(&self) -> Result<(), ferrompi::Error> {
        let Sends { under_way, spare } = &mut *self.sends();
        let mut at = 0;
        while at < under_way.len() {
            if under_way[at].test()?.is_some() {
                let buffer = under_way.swap_remove(at).into_buffer()?;
                if buffer.capacity() <= KEPT {
                    spare.push(buffer);
                }
            } else {
                at += 1;
            }
        }
        Ok(())
    }

    fn try_send(&self, to: usize, tag: u32, bytes: &[u8]) -> Result<(), ferrompi::Error> {
        self.reap()?;
        let Sends { under_way, spare } = &mut *self.sends();
        let mut buffer = spare.pop().unwrap_or_default();
        buffer.clear();
        buffer.extend_from_slice(bytes);
        let mut request = self.group.send_init(buffer, to as i32, tag as i32)?;
        request.start()?;
        under_way.push(request);
        Ok(())
    }

    /// Receives the next message, or returns `false` if a rank has failed meanwhile.
    fn try_receive(&self, from: usize, tag: u32, into: &mut Vec<u8>) -> Result<bool, ferrompi::Error> {
        let mut nap = NAPS[0];
        for round in 0.. {
            for _ in 0..ATTEMPTS {
                if let Some((message, status)) = self.group.improbe::<u8>(from as i32, Tag::Value(tag as i32))? {
                    into.resize(status.count.unwrap_or_default(), 0);
                    message.mrecv(into)?;
                    return Ok(true);
                }
                std::hint::spin_loop();
            }
            if self.shared.hear()? {
                return Ok(false);
            }
            if round >= AWAKE {
                std::thread::sleep(nap);
                if (round - AWAKE) % ALIKE == ALIKE - 1 {
                    nap = NAPS[1].min(2 * nap);
                }
            }
        }
        Ok(false)
    }
}

impl Transport for Mpi {
    fn rank(&self) -> usize {
        self.group.rank() as usize
    }

    fn size(&self) -> usize {
        self.group.size() as usize
    }

    fn send(&self, to: usize, tag: u32, bytes: &[u8]) {
        if let Err(error) = self.try_send(to, tag, bytes) {
            panic!("a message to rank {to} could not be sent: {error}");
        }
    }

    fn receive(&self, from: usize, tag: u32, into: &mut Vec<u8>) -> bool {
        self.try_receive(from, tag, into)
            .unwrap_or_else(|error| panic!("a message of rank {from} could not be received: {error}"))
    }
}

impl Drop for Mpi {
    fn drop(&mut self) {
        // The receiver of a message may be gone: nobody waits for it then.
        if std::thread::panicking() || self.shared.known().is_some() {
            std::mem::take(&mut self.sends().under_way).into_iter().for_each(std::mem::forget);
        }
    }
}
