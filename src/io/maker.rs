//! The maker of results: program, build and instruction set, on which every bit of them depends.
//!
//! Numbers are the same to the last bit for one maker alone. The linear algebra chooses its kernels
//! by what the processor offers and cannot be told otherwise, so that an instruction set is stated
//! and compared, never emulated.

use super::files;
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::OnceLock;

/// What made some results.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Maker {
    /// Version of the program.
    pub program: String,
    /// BLAKE3 digest of the program's file, first 16 hexadecimal digits; empty where it could not
    /// be read.
    pub build: String,
    /// Instruction set, see [`instruction_set`].
    pub isa: String,
}

impl Maker {
    /// This program on this machine.
    pub fn here() -> Self {
        static BUILD: OnceLock<String> = OnceLock::new();
        let build = BUILD.get_or_init(|| {
            // The file of the running program, even where another has taken its name.
            let running = Path::new("/proc/self/exe").to_owned();
            let program = if running.exists() { Ok(running) } else { std::env::current_exe() };
            let digest = program.ok().and_then(|path| files::digest(&path).ok());
            digest.map_or_else(String::new, |digest| digest[..16].to_owned())
        });
        Self {
            program: env!("CARGO_PKG_VERSION").to_owned(),
            build: build.clone(),
            isa: instruction_set().to_owned(),
        }
    }

    /// What differs between two makers: name, here, there.
    pub fn differences<'a>(&'a self, other: &'a Self) -> Vec<(&'static str, &'a str, &'a str)> {
        [
            ("program version", &self.program, &other.program),
            ("program build", &self.build, &other.build),
            ("instruction set", &self.isa, &other.isa),
        ]
        .into_iter()
        .filter(|(_, here, there)| here != there)
        .map(|(name, here, there)| (name, here.as_str(), there.as_str()))
        .collect()
    }
}

/// The instruction set that numerical code uses on this machine: the architecture, on x86-64 the
/// level of the psABI by which the kernels are chosen.
pub fn instruction_set() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::is_x86_feature_detected as has;
        if has!("avx512f") {
            "x86-64-v4"
        } else if has!("avx2") && has!("fma") {
            "x86-64-v3"
        } else if has!("sse4.2") {
            "x86-64-v2"
        } else {
            "x86-64"
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    {
        std::env::consts::ARCH
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_differs_between_makers_is_named() {
        let here = Maker::here();
        assert!(here.differences(&here.clone()).is_empty());
        assert_eq!(here.build.len(), 16);
        let there = Maker { isa: "z80".to_owned(), ..here.clone() };
        assert_eq!(here.differences(&there), [("instruction set", here.isa.as_str(), "z80")]);
    }
}
