//! The command `sollwert`: hands over to `cli`, which reads the arguments and gives the exit code. Holds no code of its own.

use std::process::ExitCode;

fn main() -> ExitCode {
    sollwert::cli::main()
}
