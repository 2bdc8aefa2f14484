//! sazanami
