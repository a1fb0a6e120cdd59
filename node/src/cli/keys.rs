//! `tessera keys`: the farm's authority and the identities that it certifies.

use std::path::PathBuf;

use clap::Subcommand;

use crate::{
    error::Result,
    manifest::rfc3339,
    wire::tls::{Authority, Certificate, Identity, Role},
};

/// Arguments of `tessera keys`.
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Make a farm: its authority, and identities of its coordinator and of a first operator.
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
    /// Show what certificates say: role, name, how long they are valid, fingerprint.
    Show {
        /// Files made by `tessera keys`.
        #[arg(required = true)]
        files: Vec<PathBuf>,
    },
    /// Certify identities anew before, or after, they expire: keys, roles and names stay. Prints until when.
    Renew {
        /// Folder of the farm's authority.
        #[arg(long, env = "TESSERA_KEYS")]
        keys: PathBuf,
        /// Files of identities, which are replaced.
        #[arg(required = true)]
        files: Vec<PathBuf>,
    },
}

/// Runs `tessera keys`.
pub fn run(args: Args) -> Result<()> {
    match args.command {
        Command::Init { folder } => {
            let authority = Authority::new()?;
            println!("{}", authority.save(&folder)?.display());
            println!("{}", authority.issue(Role::Coordinator, "coordinator")?.save(&folder)?.display());
            println!("{}", authority.issue(Role::Operator, "operator")?.save(&folder)?.display());
        }
        Command::Issue { keys, role, name, output } => {
            let identity = Authority::load(&keys)?.issue(role, &name)?;
            println!("{}", identity.save(output.as_deref().unwrap_or(&keys))?.display());
        }
        Command::Show { files } => {
            for file in files {
                let Certificate { peer, fingerprint, issued, expires } = Identity::read(&file)?.certificate;
                println!("{}: {peer}", file.display());
                println!("  valid from {} until {}", rfc3339(issued), rfc3339(expires));
                println!("  fingerprint {fingerprint}");
            }
        }
        Command::Renew { keys, files } => {
            let authority = Authority::load(&keys)?;
            for file in files {
                let renewed = authority.renew(&Identity::read(&file)?)?;
                renewed.replace(&file)?;
                println!("{}: valid until {}", file.display(), rfc3339(renewed.certificate.expires));
            }
        }
    }
    Ok(())
}
