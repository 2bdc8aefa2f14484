//! sazanami-parallel
