//! sazanami-dem
