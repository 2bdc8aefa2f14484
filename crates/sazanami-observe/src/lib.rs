//! sazanami-observe
