//! The first 64 bytes of a checkpoint.

use xxhash_rust::xxh3::xxh3_64;

use super::{MAGIC, VERSION};

/// Place and length of the index, and length of the whole file \[bytes].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Header {
    pub version: u32,
    pub index_offset: u64,
    pub index_length: u64,
    pub index_checksum: u64,
    pub file_length: u64,
}

/// Kind of a file by its first bytes.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Parsed {
    Good(Header),
    Foreign,
    Damaged,
    Version(u32),
}

impl Header {
    pub const LENGTH: usize = 64;

    pub fn new(index_offset: u64, index_length: u64, index_checksum: u64, file_length: u64) -> Self {
        Self { version: VERSION, index_offset, index_length, index_checksum, file_length }
    }

    pub fn to_bytes(self) -> [u8; Self::LENGTH] {
        let mut bytes = [0; Self::LENGTH];
        bytes[..8].copy_from_slice(&MAGIC);
        bytes[8..12].copy_from_slice(&self.version.to_le_bytes());
        bytes[12..16].copy_from_slice(&(Self::LENGTH as u32).to_le_bytes());
        let words = [self.index_offset, self.index_length, self.index_checksum, self.file_length];
        for (place, word) in bytes[16..48].chunks_exact_mut(8).zip(words) {
            place.copy_from_slice(&word.to_le_bytes());
        }
        let checksum = xxh3_64(&bytes[..56]);
        bytes[56..].copy_from_slice(&checksum.to_le_bytes());
        bytes
    }

    pub fn parse(bytes: &[u8; Self::LENGTH]) -> Parsed {
        let word = |at: usize| u64::from_le_bytes(std::array::from_fn(|i| bytes[at + i]));
        if bytes[..8] != MAGIC {
            return Parsed::Foreign;
        }
        if word(56) != xxh3_64(&bytes[..56]) {
            return Parsed::Damaged;
        }
        let version = word(8) as u32;
        if version != VERSION {
            return Parsed::Version(version);
        }
        Parsed::Good(Self {
            version,
            index_offset: word(16),
            index_length: word(24),
            index_checksum: word(32),
            file_length: word(40),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_flipped_bit_of_the_header_is_noticed() {
        let header = Header::new(1 << 33, 77, 0xdead_beef, (1 << 33) + 77);
        let bytes = header.to_bytes();
        assert_eq!(Header::parse(&bytes), Parsed::Good(header));
        for bit in 0..Header::LENGTH * 8 {
            let mut flipped = bytes;
            flipped[bit / 8] ^= 1 << (bit % 8);
            assert!(!matches!(Header::parse(&flipped), Parsed::Good(_)), "bit {bit}");
        }
        let later = Header { version: VERSION + 1, ..header };
        assert_eq!(Header::parse(&later.to_bytes()), Parsed::Version(VERSION + 1));
    }
}
