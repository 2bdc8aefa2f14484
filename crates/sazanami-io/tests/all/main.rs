//! Files that the program writes and reads again.

mod checkpoint;
mod vtk;
