//! The `tvse` program.

#![forbid(unsafe_code)]

fn main() -> std::process::ExitCode {
    tvse::cli::run()
}
