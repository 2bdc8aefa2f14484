//! Ranks as processes of an MPI.
//!
//! Without its feature `mpi` this crate needs no MPI and says so to a launcher. With it, nothing below has to be built
//! again: the crates of physics see a communicator.

#[cfg(feature = "mpi")]
mod library;

use sazanami_parallel::{JoinError, Launcher, World};

/// Joins the processes that a launcher started; `None` without a launcher, and without MPI where it started one process
/// only (`srun -n 1`). To be called once, on the main thread.
///
/// # Errors
/// If they cannot work together.
pub fn join() -> Result<Option<World>, JoinError> {
    let Some(launcher) = Launcher::seen() else { return Ok(None) };
    #[cfg(feature = "mpi")]
    return library::join(launcher).map(Some);
    #[cfg(not(feature = "mpi"))]
    if launcher.size == Some(1) { Ok(None) } else { Err(JoinError::NotBuiltIn(launcher)) }
}

/// Name and version of the MPI that this program was built with, if it was.
#[must_use]
pub fn name_of_library() -> Option<String> {
    #[cfg(feature = "mpi")]
    return Some(library::name());
    #[cfg(not(feature = "mpi"))]
    None
}
