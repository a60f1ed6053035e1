//! Whether files may name paths outside of their study.

use crate::io::scenario::Reach;

/// The option of every command that reads scenario files.
#[derive(clap::Args)]
// Else its group has the name of the command's own, which a debug build refuses.
#[group(skip)]
pub struct Args {
    /// Lets the files name paths outside of their study (the folder of the first file, or the one
    /// above it if that is called `runs`)
    #[arg(long)]
    allow_outside: bool,
}

impl Args {
    /// How far paths may reach.
    pub fn reach(&self) -> Reach {
        if self.allow_outside { Reach::Anywhere } else { Reach::Study }
    }
}
