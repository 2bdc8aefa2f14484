//! The cheap cases of verification, and experiments on coarser lattices.

mod particles;
mod subset;
