//! Progress of a campaign: a bar on a terminal, lines of JSON where they are asked for, the text of
//! the lock in any case.

#![expect(clippy::disallowed_methods, reason = "a place where the program reads the clock")]

use crate::campaign::Progress;
use crate::io::lock::Told;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::time::{Duration, Instant};

/// Time between two looks of the bar: cases may take microseconds.
const SHOWN_EVERY: Duration = Duration::from_millis(50);
/// Time between two lines of JSON, and between two texts of the lock.
const EVERY: Duration = Duration::from_secs(2);
/// Shortest time between two shards that are written because of the time alone.
const SHORTEST: Duration = Duration::from_secs(5);
/// Longest such time.
const LONGEST: Duration = Duration::from_secs(600);
/// Share of the time so far that may be lost where that is longer, one part in so many.
const LOST: u32 = 100;

/// How progress is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Show {
    /// A bar on a terminal
    Auto,
    /// One JSON object a line on the standard error, every few seconds
    Json,
    /// Nothing
    None,
}

/// Progress as it is shown, and the clock of the shards.
pub struct Shown {
    show: Show,
    bar: ProgressBar,
    begun: Instant,
    shown: Option<Instant>,
    told: Instant,
    saved: Instant,
    save_every: Option<Duration>,
}

impl Shown {
    /// Progress that begins now; with `save_every` shards are written that often.
    pub fn new(show: Show, save_every: Option<Duration>) -> Self {
        let target = if show == Show::Auto && std::io::stderr().is_terminal() {
            ProgressDrawTarget::stderr()
        } else {
            ProgressDrawTarget::hidden()
        };
        let bar = ProgressBar::with_draw_target(None, target);
        let template = "{bar:30} {pos}/{len} cases, {per_sec}, {eta} left{msg}";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        let now = Instant::now();
        Self { show, bar, begun: now, shown: None, told: now, saved: now, save_every }
    }

    /// Begins with `total` cases.
    pub fn begin(&mut self, total: u64) {
        self.bar.set_length(total);
        let now = Instant::now();
        (self.begun, self.told, self.saved) = (now, now, now);
    }

    /// Shows how far the campaign has come; gives what is to be told to others, when it is time.
    pub fn show(&mut self, progress: &Progress) -> Option<Told> {
        let last = progress.done == progress.total;
        let now = Instant::now();
        if !last && self.shown.is_some_and(|shown| now - shown < SHOWN_EVERY) {
            return None;
        }
        self.shown = Some(now);
        self.bar.set_position(progress.done);
        if progress.failed > 0 || progress.unstable > 0 {
            let Progress { unstable, failed, .. } = progress;
            self.bar.set_message(format!(", {unstable} unstable, {failed} failed"));
        }
        if now - self.told < EVERY && !last {
            return None;
        }
        self.told = now;
        let told = self.told_of(progress);
        if self.show == Show::Json {
            let line = serde_json::to_string(&told).expect("text keys only");
            super::say(line);
        }
        Some(told)
    }

    fn told_of(&self, progress: &Progress) -> Told {
        let Progress { total, done, failed, unstable } = *progress;
        let cases_per_s = done as f64 / self.begun.elapsed().as_secs_f64().max(1e-9);
        let left_s = (done > 0).then(|| (total - done) as f64 / cases_per_s);
        Told { total, done, failed, unstable, cases_per_s, left_s }
    }

    /// Whether it is time to write a shard: every few seconds, less often in a long campaign.
    pub fn due(&mut self) -> bool {
        let pause = (self.begun.elapsed() / LOST).clamp(SHORTEST, LONGEST);
        let pause = self.save_every.unwrap_or(pause);
        let due = self.saved.elapsed() >= pause;
        if due {
            self.saved = Instant::now();
        }
        due
    }

    /// Takes the bar away.
    pub fn clear(&self) {
        self.bar.finish_and_clear();
    }
}

/// A time in words.
pub fn duration(seconds: f64) -> String {
    let seconds = seconds.round() as u64;
    match seconds {
        0..60 => format!("{seconds} s"),
        60..3600 => format!("{} min {} s", seconds / 60, seconds % 60),
        _ => format!("{} h {} min", seconds / 3600, seconds / 60 % 60),
    }
}
