//! sazanami-numerics
