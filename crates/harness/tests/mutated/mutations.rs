//! Mutations of files: flipped bits, huge numbers, cuts, and parts that are duplicated or come from another file.

use std::ops::Range;

use fastrand::Rng;

/// Numbers that tend to break sizes and offsets.
const NUMBERS: [u64; 10] =
    [0, 1, 0x7f, 0xff, 0x7fff, 0xffff, 0x7fff_ffff, 0xffff_ffff, 0x7fff_ffff_ffff_ffff, u64::MAX];

/// The same as text, and texts that are not numbers.
const WORDS: [&[u8]; 10] =
    [b"0", b"-1", b"65537", b"2147483648", b"4294967296", b"18446744073709551616", b"1e308", b"-1e-308", b"nan", b""];

/// One of the seeds after one to four mutations.
pub(crate) fn mutated(seeds: &[Vec<u8>], random: &mut Rng) -> Vec<u8> {
    let mut bytes = random.choice(seeds).cloned().unwrap_or_default();
    for _ in 0..random.u32(1..=4) {
        mutate(&mut bytes, seeds, random);
    }
    bytes
}

fn mutate(bytes: &mut Vec<u8>, seeds: &[Vec<u8>], random: &mut Rng) {
    let at = place(bytes, random);
    match random.u8(..8) {
        0 | 1 if at < bytes.len() => bytes[at] ^= 1 << random.u32(..8),
        2 => overwrite(bytes, at, random),
        3 | 4 => replace_number(bytes, at, random),
        5 => bytes.truncate(at),
        6 => drop(bytes.drain(part(bytes, at, random))),
        _ => insert(bytes, at, seeds, random),
    }
}

/// A random position; half of the time near the start, where headers are.
fn place(bytes: &[u8], random: &mut Rng) -> usize {
    let most = if random.bool() { bytes.len() } else { bytes.len().min(64) };
    random.usize(..=most)
}

/// Up to 32 bytes from `at` on.
fn part(bytes: &[u8], at: usize, random: &mut Rng) -> Range<usize> {
    at..(at + random.usize(..=32)).min(bytes.len())
}

/// Writes a number of 1, 2, 4 or 8 bytes in either byte order.
fn overwrite(bytes: &mut [u8], at: usize, random: &mut Rng) {
    let len = 1 << random.u32(..4);
    let number = NUMBERS[random.usize(..NUMBERS.len())];
    let little = &number.to_le_bytes()[..len];
    let big = little.iter().rev().copied().collect::<Vec<u8>>();
    let stored = if random.bool() { little } else { &big };
    bytes[at..].iter_mut().zip(stored).for_each(|(byte, stored)| *byte = *stored);
}

/// Replaces the next number in the text.
fn replace_number(bytes: &mut Vec<u8>, at: usize, random: &mut Rng) {
    let Some(start) = bytes[at..].iter().position(u8::is_ascii_digit).map(|i| at + i) else { return };
    let len = bytes[start..].iter().position(|byte| !byte.is_ascii_digit()).unwrap_or(bytes.len() - start);
    bytes.splice(start..start + len, WORDS[random.usize(..WORDS.len())].iter().copied());
}

/// Duplicates a part, or inserts one of another seed.
fn insert(bytes: &mut Vec<u8>, at: usize, seeds: &[Vec<u8>], random: &mut Rng) {
    let other = if random.bool() { bytes.clone() } else { random.choice(seeds).cloned().unwrap_or_default() };
    let from = place(&other, random);
    let inserted = &other[part(&other, from, random)];
    bytes.splice(at..at, inserted.iter().copied());
}
