//! The progress bar of a campaign: on a terminal, and nowhere else.

use crate::campaign::Progress;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;

/// A bar on the standard error for `total` cases; hidden where that is no terminal.
pub fn bar(total: u64) -> ProgressBar {
    let target = if std::io::stderr().is_terminal() {
        ProgressDrawTarget::stderr()
    } else {
        ProgressDrawTarget::hidden()
    };
    let bar = ProgressBar::with_draw_target(Some(total), target);
    let template = "{bar:30} {pos}/{len} cases, {per_sec}, {eta} left{msg}";
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
    bar
}

/// Shows how far a campaign has come.
pub fn show(bar: &ProgressBar, progress: &Progress) {
    bar.set_position(progress.done);
    if progress.failed > 0 || progress.unstable > 0 {
        bar.set_message(format!(", {} unstable, {} failed", progress.unstable, progress.failed));
    }
}
