//! `tessera keys`: the farm's authority and the identities that it certifies.

use std::path::PathBuf;

use clap::Subcommand;

use crate::{
    error::Result,
    wire::tls::{Authority, Role},
};

/// Arguments of `tessera keys`.
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Make a farm: its authority, and identities of its coordinator and of a first client.
    Init {
        /// Folder of the keys, made where it is missing. Keep it where only you can read it.
        folder: PathBuf,
    },
    /// Certify a process: prints the path of a file to carry to its machine.
    Issue {
        /// Folder of the farm's authority.
        #[arg(long, env = "TESSERA_KEYS")]
        keys: PathBuf,
        /// What the process may do.
        #[arg(long)]
        role: Role,
        /// Its name, as it stands in tables and logs: one a machine.
        #[arg(long)]
        name: String,
        /// Folder of the new identity, if not that of the authority.
        #[arg(long, short)]
        output: Option<PathBuf>,
    },
}

/// Runs `tessera keys`.
pub fn run(args: Args) -> Result<()> {
    match args.command {
        Command::Init { folder } => {
            let authority = Authority::new()?;
            println!("{}", authority.save(&folder)?.display());
            println!("{}", authority.issue(Role::Coordinator, "coordinator")?.save(&folder)?.display());
            println!("{}", authority.issue(Role::Client, "client")?.save(&folder)?.display());
        }
        Command::Issue { keys, role, name, output } => {
            let identity = Authority::load(&keys)?.issue(role, &name)?;
            println!("{}", identity.save(output.as_deref().unwrap_or(&keys))?.display());
        }
    }
    Ok(())
}
