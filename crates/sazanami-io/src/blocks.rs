//! LZ4 compression in blocks, in parallel, with or without the bytes of equal weight brought together.

use std::io;

use sazanami_parallel::for_each_chunk;

/// Bytes of a block before compression: a multiple of every element size.
pub(crate) const BLOCK: usize = 1 << 18;
/// Blocks compressed before any of them is handed on.
const BATCH: usize = 32;

/// Buffers of one block.
#[derive(Clone, Default)]
struct Slot {
    shuffled: Vec<u8>,
    packed: Vec<u8>,
    length: usize,
}

/// Whether a block that does not shrink is kept as it is (its stored length then equals its raw one).
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Incompressible {
    Keep,
    Compress,
}

/// Hands the compressed blocks of `raw` to `emit`, in order. The bytes do not depend on the number of threads.
///
/// With `width` above 1 byte `b` of all `width`-byte elements of a block comes before byte `b + 1`.
pub(crate) fn compress(
    raw: &[u8],
    width: usize,
    incompressible: Incompressible,
    mut emit: impl FnMut(&[u8]) -> io::Result<()>,
) -> io::Result<()> {
    let mut slots = vec![Slot::default(); BATCH.min(raw.len().div_ceil(BLOCK))];
    for batch in raw.chunks(BLOCK * BATCH) {
        let count = batch.len().div_ceil(BLOCK);
        for_each_chunk(&mut slots[..count], 1, |number, slot: &mut [Slot]| {
            let end = batch.len().min((number + 1) * BLOCK);
            slot[0].compress(&batch[number * BLOCK..end], width, incompressible);
        });
        for slot in &slots[..count] {
            emit(&slot.packed[..slot.length])?;
        }
    }
    Ok(())
}

impl Slot {
    fn compress(&mut self, raw: &[u8], width: usize, incompressible: Incompressible) {
        let Self { shuffled, packed, length } = self;
        packed.resize(lz4_flex::block::get_maximum_output_size(raw.len()), 0);
        let source = if width > 1 {
            shuffled.resize(raw.len(), 0);
            shuffle(raw, width, shuffled);
            &shuffled[..]
        } else {
            raw
        };
        *length = lz4_flex::block::compress_into(source, packed).expect("the buffer has LZ4's largest output size");
        if incompressible == Incompressible::Keep && *length >= source.len() {
            packed[..source.len()].copy_from_slice(source);
            *length = source.len();
        }
    }
}

/// One block to be unpacked.
struct Unpack<'a> {
    stored: &'a [u8],
    raw: &'a mut [u8],
    good: bool,
}

/// Undoes [`compress`] with `Incompressible::Keep`: `stored` holds the blocks one after the other, with the lengths
/// in `lengths`. Returns whether everything fitted.
pub(crate) fn decompress(stored: &[u8], lengths: impl Iterator<Item = usize>, width: usize, raw: &mut [u8]) -> bool {
    let mut blocks = Vec::with_capacity(raw.len().div_ceil(BLOCK));
    let (mut rest, mut raw_blocks) = (stored, raw.chunks_mut(BLOCK));
    for length in lengths {
        let (Some(raw), true) = (raw_blocks.next(), length <= rest.len()) else { return false };
        let (stored, after) = rest.split_at(length);
        rest = after;
        blocks.push(Unpack { stored, raw, good: false });
    }
    if !rest.is_empty() || raw_blocks.next().is_some() {
        return false;
    }
    for_each_chunk(&mut blocks[..], 4, |_, blocks: &mut [Unpack]| {
        let mut shuffled = Vec::new();
        for block in blocks {
            block.good = unpack(block.stored, width, block.raw, &mut shuffled);
        }
    });
    blocks.iter().all(|block| block.good)
}

fn unpack(stored: &[u8], width: usize, raw: &mut [u8], shuffled: &mut Vec<u8>) -> bool {
    shuffled.resize(raw.len(), 0);
    if stored.len() == raw.len() {
        shuffled.copy_from_slice(stored);
    } else if !lz4_flex::block::decompress_into(stored, shuffled).is_ok_and(|length| length == raw.len()) {
        return false;
    }
    if width > 1 {
        unshuffle(shuffled, width, raw);
    } else {
        raw.copy_from_slice(shuffled);
    }
    true
}

fn shuffle(raw: &[u8], width: usize, shuffled: &mut [u8]) {
    match width {
        4 => shuffle_elements::<4>(raw, shuffled),
        8 => shuffle_elements::<8>(raw, shuffled),
        _ => unreachable!("elements have 1, 4 or 8 bytes"),
    }
}

fn unshuffle(shuffled: &[u8], width: usize, raw: &mut [u8]) {
    match width {
        4 => unshuffle_elements::<4>(shuffled, raw),
        8 => unshuffle_elements::<8>(shuffled, raw),
        _ => unreachable!("elements have 1, 4 or 8 bytes"),
    }
}

fn shuffle_elements<const WIDTH: usize>(raw: &[u8], shuffled: &mut [u8]) {
    let elements = raw.as_chunks::<WIDTH>().0;
    for (byte, lane) in shuffled.chunks_exact_mut(elements.len().max(1)).enumerate() {
        for (out, element) in lane.iter_mut().zip(elements) {
            *out = element[byte];
        }
    }
}

fn unshuffle_elements<const WIDTH: usize>(shuffled: &[u8], raw: &mut [u8]) {
    let elements = raw.as_chunks_mut::<WIDTH>().0;
    for (byte, lane) in shuffled.chunks_exact(elements.len().max(1)).enumerate() {
        for (element, &value) in elements.iter_mut().zip(lane) {
            element[byte] = value;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sazanami_parallel::with_threads;

    fn packed(raw: &[u8], width: usize) -> (Vec<u8>, Vec<usize>) {
        let (mut stored, mut lengths) = (Vec::new(), Vec::new());
        compress(raw, width, Incompressible::Keep, |block| {
            stored.extend_from_slice(block);
            lengths.push(block.len());
            Ok(())
        })
        .unwrap();
        (stored, lengths)
    }

    #[test]
    fn blocks_come_back_for_any_number_of_threads() {
        let smooth: Vec<f64> = (0..3 * BLOCK / 8 + 17).map(|i| (i as f64 * 1e-3).sin()).collect();
        let noise: Vec<u32> = (0..100_000_u32).map(|i| i.wrapping_mul(2_654_435_761).rotate_left(i % 31)).collect();
        for (raw, width) in
            [(bytemuck::cast_slice::<_, u8>(&smooth), 8), (bytemuck::cast_slice(&noise), 4), (&[7], 1), (&[], 8)]
        {
            let on = |threads| with_threads(threads, || packed(raw, width)).unwrap();
            let (stored, lengths) = on(1);
            assert_eq!((&stored, &lengths), (&on(3).0, &lengths));
            let mut back = vec![0; raw.len()];
            assert!(decompress(&stored, lengths.iter().copied(), width, &mut back));
            assert!(back == raw);
            if raw.len() > BLOCK {
                let mut wrong = lengths.clone();
                wrong[0] -= 1;
                assert!(!decompress(&stored, wrong.into_iter(), width, &mut back));
            }
        }
        assert!(packed(bytemuck::cast_slice(&smooth), 8).0.len() < smooth.len() * 8);
    }
}
