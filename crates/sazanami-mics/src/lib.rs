//! sazanami-mics
