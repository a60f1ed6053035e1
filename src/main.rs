//! The `tvse` program.

fn main() -> std::process::ExitCode {
    tvse::cli::run()
}
