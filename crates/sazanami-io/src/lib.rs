//! sazanami-io
