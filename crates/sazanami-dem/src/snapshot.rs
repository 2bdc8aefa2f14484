//! Complete state of the grains as named arrays.
