//! The command line: arguments, progress and messages. All else is the library's.
//!
//! Exit codes: 0 done, 1 failed, 2 wrong usage, 130 interrupted. Results that were asked for go to
//! stdout, everything else to stderr.

mod args;
mod bench;
mod info;
mod load;
mod render;

use std::fmt::Display;
use std::io::{self, Write};
use std::process::ExitCode;

use clap::Parser;

use args::{Cli, Command};

/// Why a command ended early.
enum Stop {
    /// Failed, with the one message for the user.
    Failed(String),
    /// Ctrl-C.
    Interrupted,
}

impl Stop {
    fn failed(error: impl Display) -> Self {
        Self::Failed(error.to_string())
    }
}

/// Runs the command that the arguments name.
pub(crate) fn run() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => {
            // Help and version come here, too. If nobody listens, there is nobody to tell.
            let _ = error.print();
            return ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2));
        }
    };
    let done = match &cli.command {
        Command::Render(args) => render::run(args),
        Command::Info(args) => info::run(args),
        Command::Bench(args) => bench::run(args),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(Stop::Failed(message)) => {
            say(&format!("error: {message}"));
            ExitCode::from(1)
        }
        Err(Stop::Interrupted) => {
            say("interrupted");
            ExitCode::from(130)
        }
    }
}

/// One line on stderr; a closed stderr is nobody's loss.
fn say(line: &str) {
    let _ = writeln!(io::stderr().lock(), "{line}");
}

/// Writes a result to stdout. A reader that has gone, as `head` does, has what it wanted.
fn answer(text: &str) -> Result<(), Stop> {
    let mut stdout = io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(Stop::Failed(format!("stdout: {error}")))
        }
        _ => Ok(()),
    }
}
