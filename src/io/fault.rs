//! Faults of a disk, injected for tests at every step that changes something on it.
//!
//! In a built program no step ever fails here. What the steps are is decided in `files`, `folder`
//! and `lock`.

/// A step is about to be taken; in tests it may fail.
#[cfg(not(test))]
#[inline]
pub fn step() -> std::io::Result<()> {
    Ok(())
}

/// Whether the disk is gone, so that nothing can be tidied up.
#[cfg(not(test))]
#[inline]
pub fn gone() -> bool {
    false
}

#[cfg(test)]
pub use injected::{Fault, gone, inject, step, taken};

#[cfg(test)]
mod injected {
    use std::cell::Cell;
    use std::io;

    /// What happens at a step.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum Fault {
        /// No space is left, at this step alone.
        Full,
        /// The power fails: this step and all that follow do not happen, nothing is tidied up.
        Power,
    }

    thread_local! {
        static PLAN: Cell<Option<(u64, Fault)>> = const { Cell::new(None) };
        static TAKEN: Cell<u64> = const { Cell::new(0) };
    }

    /// Injects a fault at the step with this number, from 0, counted from now; or none.
    pub fn inject(plan: Option<(u64, Fault)>) {
        PLAN.set(plan);
        TAKEN.set(0);
    }

    /// Steps taken since the last [`inject`].
    pub fn taken() -> u64 {
        TAKEN.get()
    }

    /// A step is about to be taken by this thread.
    pub fn step() -> io::Result<()> {
        let number = TAKEN.replace(TAKEN.get() + 1);
        match PLAN.get() {
            Some((at, Fault::Full)) if number == at => {
                Err(io::Error::new(io::ErrorKind::StorageFull, "no storage space (injected)"))
            }
            Some((at, Fault::Power)) if number >= at => Err(io::Error::other("power (injected)")),
            _ => Ok(()),
        }
    }

    /// Whether the power has failed.
    pub fn gone() -> bool {
        matches!(PLAN.get(), Some((at, Fault::Power)) if TAKEN.get() > at)
    }
}
