//! Interrupts: a signal that asks a long command to stop, and the exit code that tells of it.
//!
//! What stopping means is decided by the command; a second signal ends the program at once.

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Whether and by which signal the program was asked to stop.
#[derive(Debug, Default)]
pub struct Interrupt {
    stop: Arc<AtomicBool>,
    signal: Arc<AtomicUsize>,
}

impl Interrupt {
    /// Listens to SIGINT (Ctrl-C) and SIGTERM from now on.
    ///
    /// # Errors
    /// The system's message if it does not let the program listen.
    pub fn listen() -> io::Result<Self> {
        let interrupt = Self::default();
        for (signal, number) in [(SIGINT, 2_u8), (SIGTERM, 15)] {
            // In this order: the first signal sets the flag, the second finds it set.
            let code = 128 + i32::from(number);
            flag::register_conditional_shutdown(signal, code, interrupt.stop.clone())?;
            flag::register_usize(signal, interrupt.signal.clone(), usize::from(number))?;
            flag::register(signal, interrupt.stop.clone())?;
        }
        Ok(interrupt)
    }

    /// Set once the program is asked to stop.
    pub fn stop(&self) -> &AtomicBool {
        &self.stop
    }

    /// Exit code of a program that a signal stopped: 128 and the number of the signal.
    pub fn code(&self) -> u8 {
        u8::try_from(128 + self.signal.load(Ordering::Relaxed)).unwrap_or(u8::MAX)
    }
}
