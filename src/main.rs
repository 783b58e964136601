//! The command `sollwert`: hands over to `cli`.

use std::process::ExitCode;

fn main() -> ExitCode {
    sollwert::cli::main()
}
