//! The fuzz targets on stable Rust: the committed corpus, all programs, and seeded mutations of them. No panic, no hang, no memory
//! that grows with what the program does.
//!
//! One test in this file: the allocator counts for the whole process. `fuzz/README.md` says how to fuzz on.

#[path = "random/mod.rs"]
mod random;
#[path = "../fuzz/src/lib.rs"]
mod targets;

use random::Random;
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};
use std::alloc::System;
use std::path::{Path, PathBuf};

#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

const SEED: u64 = 7_112_026;
/// Mutations of each input. `SOLLWERT_FUZZ_ROUNDS` asks for more.
const ROUNDS: u32 = 3;
/// What stays allocated after an input is done with: caches of the process, nothing more.
const KEPT_BYTES_MAX: usize = 4 << 20;
/// Pieces of the language that mutations put in.
const PIECES: &[&str] = &[
    "G2",
    "G3 ",
    "CR=",
    "I",
    "J=AC(",
    "=",
    "(",
    ")",
    "[",
    "]",
    "\"",
    "'HFF'",
    "1EX308",
    "-",
    "<<",
    "==",
    " AND ",
    "NOT ",
    "R[",
    "R1=",
    "SIN(",
    "\n",
    "\r\n",
    ";",
    "/",
    ":",
    "N10 ",
    "IF ",
    "ENDIF\n",
    "WHILE 1\n",
    "ENDWHILE\n",
    "FOR R1=1 TO ",
    "GOTOB ",
    "GOTOS\n",
    "REPEAT ",
    "UNTIL ",
    "CASE ",
    "DEF INT ",
    "DEF STRING[400] ",
    "SET(",
    "REP(",
    "TRANS ",
    "ROT RPL=",
    "MIRROR X0",
    "SCALE X",
    "G54 ",
    "G91 ",
    "G95 F",
    "G93 ",
    "TURN=",
    "CIP ",
    "CT ",
    "ASPLINE ",
    "BSPLINE ",
    "CSPLINE ",
    "POLY PO[X]=(",
    "PL=",
    "RND=",
    "AP=",
    "RP=",
    "G110 ",
    "POS[X]=",
    "MCALL ",
    "CALL ",
    "L1 P99999\n",
    "PROC ",
    "M17\n",
    "$P_EP[X]",
    "$AA_IM[X]",
    "$TC_DP3[1,1]=",
    "MSG(",
    "SUBSTR(",
    "SPRINT(",
    "CTRANS(X,",
    ":CROT(Z,",
    "99999999999",
    "\0",
    "\u{feff}",
    "\u{e4}",
    "%_N_A_MPF\n",
    ";$PATH=/_N_MPF_DIR\n",
];

fn files(folder: PathBuf, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display())) {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files(path, found);
        } else if !path.extension().is_some_and(|ending| ending == "moves" || ending == "rs") {
            found.push(path);
        }
    }
}

fn mutated(input: &[u8], other: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = input.to_vec();
    for _ in 0..=random.below(6) {
        let at = random.below(bytes.len() as u32 + 1) as usize;
        match random.below(6) {
            0 => {
                let piece = PIECES[random.below(PIECES.len() as u32) as usize];
                bytes.splice(at..at, piece.bytes());
            }
            1 => {
                let end = (at + random.below(40) as usize).min(bytes.len());
                bytes.drain(at..end);
            }
            2 if at < bytes.len() => bytes[at] = random.below(256) as u8,
            3 if at < bytes.len() => bytes[at] ^= 1 << random.below(8),
            // Lines from elsewhere, in the middle of everything.
            4 => {
                let from = random.below(other.len() as u32 + 1) as usize;
                let to = (from + random.below(200) as usize).min(other.len());
                bytes.splice(at..at, other[from..to].iter().copied());
            }
            _ => {
                let end = (at + random.below(60) as usize).min(bytes.len());
                let again = bytes[at..end].to_vec();
                bytes.splice(at..at, again);
            }
        }
    }
    bytes
}

#[test]
fn no_input_breaks_anything() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut paths = Vec::new();
    for folder in ["fuzz/corpus", "programs", "tests/language"] {
        files(root.join(folder), &mut paths);
    }
    paths.sort();
    let inputs: Vec<Vec<u8>> = paths.iter().map(|path| std::fs::read(path).unwrap()).collect();
    assert!(inputs.len() > 100);
    let rounds = std::env::var("SOLLWERT_FUZZ_ROUNDS").ok().and_then(|text| text.parse().ok()).unwrap_or(ROUNDS);
    let mut random = Random::new(SEED);
    let mut most = 0;
    for (input, path) in inputs.iter().zip(&paths) {
        for round in 0..=rounds {
            let other = &inputs[random.below(inputs.len() as u32) as usize];
            let bytes = if round == 0 { input.clone() } else { mutated(input, other, &mut random) };
            let region = Region::new(ALLOCATOR);
            let done = std::panic::catch_unwind(|| {
                targets::text(&bytes);
                targets::interpreter(&bytes);
            });
            let name = path.display();
            if done.is_err() {
                let kept = Path::new(env!("CARGO_TARGET_TMPDIR")).join("broken.mpf");
                std::fs::write(&kept, &bytes).unwrap();
                panic!("{name}, round {round}, seed {SEED}: the input is {}", kept.display());
            }
            let change = region.change();
            let kept = change.bytes_allocated.saturating_sub(change.bytes_deallocated);
            most = most.max(kept);
            assert!(kept < KEPT_BYTES_MAX, "{name}, round {round}: {kept} bytes are kept");
        }
    }
}
