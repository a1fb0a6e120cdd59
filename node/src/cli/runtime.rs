//! What every subcommand that talks needs: logs, a runtime, and an ear for the user's signals.

use std::{future::Future, io::IsTerminal, task::Poll, thread, time::Duration};

use tokio::{
    runtime::Runtime,
    signal::unix::{SignalKind, signal},
    sync::watch,
};
use tracing_subscriber::EnvFilter;

use super::farewell::Farewell;
use crate::error::{Error, ExitCode, Result};

/// Logs go to stderr, as the environment variable `TESSERA_LOG` says (`warn`, `info`, `tessera_node=debug`, ...).
pub fn start_logs(default: &str) {
    let filter = EnvFilter::try_from_env("TESSERA_LOG").unwrap_or_else(|_| EnvFilter::new(default));
    // Only the first caller's settings count.
    let colors = std::io::stderr().is_terminal();
    let _ = tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).with_ansi(colors).with_target(false).try_init();
}

/// Room for scripts that call themselves, as the main thread has it.
const STACK: usize = 8 << 20;

/// A runtime with two threads: the network's work is small.
///
/// # Errors
/// When the system gives no threads.
pub fn runtime() -> Result<Runtime> {
    tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .thread_stack_size(STACK)
        .enable_all()
        .build()
        .map_err(|error| Error::new(ExitCode::Internal, format!("cannot start: {error}")))
}

/// Runs a client's work until it is done or the user interrupts it.
///
/// # Errors
/// Those of the work; [`ExitCode::Interrupted`] when the user interrupts it: see [`interrupted`].
pub fn block_on<T>(work: impl Future<Output = Result<T>>) -> Result<T> {
    block_on_farm(&Farewell::default(), work)
}

/// The same for work that a farm goes on with: the user is told with what.
///
/// # Errors
/// As those of [`block_on`].
pub fn block_on_farm<T>(farewell: &Farewell, work: impl Future<Output = Result<T>>) -> Result<T> {
    let runtime = runtime()?;
    let result = runtime.block_on(async {
        // Before the work begins: what it leaves behind must not depend on how soon the signal comes.
        let interrupted = interrupted();
        tokio::select! {
            // First: what is done is done.
            biased;
            result = work => result,
            () = interrupted => Err(Error { help: farewell.help(), ..Error::new(ExitCode::Interrupted, "interrupted") }),
        }
    });
    runtime.shutdown_timeout(Duration::from_millis(100));
    result
}

/// Listens from now on for Ctrl-C, SIGTERM, and the end of the terminal, unless the user wants that to be ignored (`nohup`); waits for the first of them. To be called within a runtime.
pub fn interrupted() -> impl Future<Output = ()> {
    let kinds = [Some(SignalKind::interrupt()), Some(SignalKind::terminate()), (!ignores_hangup()).then(SignalKind::hangup)];
    let mut signals: Vec<_> = kinds.into_iter().flatten().filter_map(|kind| signal(kind).ok()).collect();
    std::future::poll_fn(move |context| {
        let has_come = signals.iter_mut().any(|signal| signal.poll_recv(context).is_ready());
        if has_come { Poll::Ready(()) } else { Poll::Pending }
    })
}

/// Whether SIGHUP was to be ignored when the program began, as Linux tells (proc_pid_status(5)); elsewhere it is left alone.
fn ignores_hangup() -> bool {
    let Ok(status) = std::fs::read_to_string("/proc/self/status") else { return true };
    let ignored = status.lines().find_map(|line| u64::from_str_radix(line.strip_prefix("SigIgn:")?.trim(), 16).ok());
    ignored.is_none_or(|ignored| ignored & 1 == 1)
}

/// Counts how often this process was told to end, by Ctrl-C or SIGTERM.
///
/// # Errors
/// When the system gives no threads.
pub fn count_signals() -> Result<watch::Receiver<u32>> {
    let (count, counted) = watch::channel(0);
    let internal = |error: std::io::Error| Error::new(ExitCode::Internal, format!("cannot start: {error}"));
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(internal)?;
    let listen = move || {
        runtime.block_on(async {
            let (Ok(mut interrupt), Ok(mut terminate)) = (signal(SignalKind::interrupt()), signal(SignalKind::terminate())) else { return };
            loop {
                tokio::select! {
                    _ = interrupt.recv() => {}
                    _ = terminate.recv() => {}
                }
                count.send_modify(|count| *count += 1);
            }
        });
    };
    thread::Builder::new().name("signals".to_owned()).spawn(listen).map_err(internal)?;
    Ok(counted)
}
