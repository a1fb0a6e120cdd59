//! `tessera keys`: the farm's authority and the identities that it certifies.

use std::{
    path::{Path, PathBuf},
    time::{Duration, UNIX_EPOCH},
};

use clap::Subcommand;

use super::{join, render::check_writable, runtime::block_on};
use crate::{
    error::{Error, ExitCode, Result},
    files::write_whole,
    limits::TOKEN_VALIDITY,
    manifest::rfc3339,
    wire::tls::{Authority, Certificate, Identity, Revocation, Revocations, Revoked, Role, check_name, write_private},
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
    /// Certify identities anew: roles and names stay. Prints until when.
    ///
    /// With --keys, the farm's authority does it, before or after they expire. With --coordinator, the coordinator does it for nodes, submitters and
    /// observers whose certificates are still valid, and they get new keys.
    #[command(group(clap::ArgGroup::new("by").required(true).args(["keys", "coordinator"])))]
    Renew {
        /// Folder of the farm's authority.
        #[arg(long)]
        keys: Option<PathBuf>,
        /// Host and port of a coordinator that has an issuer.
        #[arg(long, value_name = "HOST:PORT")]
        coordinator: Option<String>,
        /// Files of identities, which are replaced.
        #[arg(required = true)]
        files: Vec<PathBuf>,
    },
    /// Make the key with which a coordinator certifies those who join; `init` makes one too.
    Issuer {
        /// Folder of the farm's authority.
        #[arg(long, env = "TESSERA_KEYS")]
        keys: PathBuf,
    },
    /// Make a join token and print it: whoever has it may join once, or so many times, until it expires.
    Token {
        /// Folder with the farm's issuer, or its file.
        #[arg(long, env = "TESSERA_KEYS")]
        keys: PathBuf,
        /// What those may do who join: node, submitter or observer.
        #[arg(long)]
        role: Role,
        /// Their name [default: each brings one that is new to the farm].
        #[arg(long)]
        name: Option<String>,
        /// Keys that it certifies.
        #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=10_000))]
        uses: u32,
        /// Seconds until it expires.
        #[arg(long, default_value_t = TOKEN_VALIDITY.as_secs(), value_name = "SECONDS", value_parser = clap::value_parser!(u64).range(1..=31_536_000))]
        valid: u64,
        /// Write it into this new file, for its owner alone, in the place of stdout.
        #[arg(long, short, value_name = "FILE")]
        output: Option<PathBuf>,
    },
    /// Join a farm: makes a key here, has the coordinator certify it with a join token, and prints the path of the new identity.
    Join {
        /// Host and port of the coordinator.
        #[arg(long, env = "TESSERA_COORDINATOR", value_name = "HOST:PORT")]
        coordinator: String,
        /// File with the join token; `-` reads stdin [default: the systemd credential `join-token`].
        #[arg(long, value_name = "FILE")]
        token: Option<PathBuf>,
        /// The name of this machine or person in the farm, where the token says none.
        #[arg(long)]
        name: Option<String>,
        /// Folder of the new identity.
        #[arg(long, short, default_value = ".", value_name = "DIR")]
        output: PathBuf,
    },
    /// Revoke certificates: adds to a list that the coordinator reads again when it changes.
    Revoke {
        /// A name (every certificate of that name made until now), a certificate's fingerprint, or with --token a token's number.
        what: String,
        /// The list, made where it is missing: that of the coordinator's --revoked.
        #[arg(long, env = "TESSERA_REVOKED", value_name = "FILE")]
        list: PathBuf,
        /// Why; told to those who are refused.
        #[arg(long, default_value = "")]
        reason: String,
        /// It is a join token.
        #[arg(long)]
        token: bool,
    },
}

/// Runs `tessera keys`.
pub fn run(args: Args) -> Result<()> {
    match args.command {
        Command::Init { folder } => {
            let authority = Authority::new()?;
            println!("{}", authority.save(&folder)?.display());
            println!("{}", authority.delegate()?.save_issuer(&folder)?.display());
            println!("{}", authority.issue(Role::Coordinator, "coordinator")?.save(&folder)?.display());
            println!("{}", authority.issue(Role::Operator, "operator")?.save(&folder)?.display());
        }
        Command::Issue { keys, role, name, output } => {
            let identity = Authority::load(&keys)?.issue(role, &name)?;
            println!("{}", identity.save(output.as_deref().unwrap_or(&keys))?.display());
        }
        Command::Show { files } => {
            for file in files {
                let Certificate { peer, fingerprint, issued, expires, .. } = Identity::read(&file)?.certificate;
                println!("{}: {peer}", file.display());
                println!("  valid from {} until {}", rfc3339(issued), rfc3339(expires));
                println!("  fingerprint {fingerprint}");
            }
        }
        Command::Renew { keys, coordinator, files } => {
            let authority = keys.as_deref().map(Authority::load).transpose()?;
            for file in files {
                let identity = Identity::read(&file)?;
                let renewed = match (&authority, &coordinator) {
                    (Some(authority), _) => authority.renew(&identity)?,
                    (None, coordinator) => block_on(join::renew(coordinator.as_deref().unwrap_or_default(), &identity))?,
                };
                renewed.replace(&file)?;
                println!("{}: valid until {}", file.display(), rfc3339(renewed.certificate.expires));
            }
        }
        Command::Issuer { keys } => println!("{}", Authority::load(&keys)?.delegate()?.save_issuer(&keys)?.display()),
        Command::Token { keys, role, name, uses, valid, output } => token(&keys, role, name, uses, Duration::from_secs(valid), output)?,
        Command::Join { coordinator, token, name, output } => {
            let token = join::read_token(token.as_deref())?;
            check_writable(&output)?;
            let identity = block_on(join::join(&coordinator, &token, name))?;
            println!("{}", identity.save(&output)?.display());
        }
        Command::Revoke { what, list, reason, token } => revoke(what, &list, &reason, token)?,
    }
    Ok(())
}

fn token(keys: &Path, role: Role, name: Option<String>, uses: u32, valid: Duration, output: Option<PathBuf>) -> Result<()> {
    if !Role::JOINING.contains(&role) {
        return Err(Error::new(ExitCode::Usage, format!("no {role} joins with a token")).with_help("issue its key: tessera keys issue"));
    }
    name.as_deref().map(check_name).transpose()?;
    let issuer = Authority::load_issuer(keys)?;
    let made = issuer.make_token(role, name, uses, valid).map_err(|error| Error::new(ExitCode::Internal, error))?;
    let (token, text) = made;
    match output {
        Some(path) => {
            write_private(&path, &format!("{text}\n"))?;
            println!("{}", path.display());
        }
        None => println!("{text}"),
    }
    let until = rfc3339(UNIX_EPOCH + Duration::from_secs(token.expires));
    eprintln!("join token {}: {role}, good for {uses} until {until}", token.number());
    Ok(())
}

fn revoke(what: String, list: &Path, reason: &str, token: bool) -> Result<()> {
    let is_fingerprint = what.len() == 64 && what.chars().all(|c| c.is_ascii_hexdigit());
    let revoked = if token {
        Revoked::Token(what.to_ascii_lowercase())
    } else if is_fingerprint {
        Revoked::Certificate(what.to_ascii_lowercase())
    } else {
        check_name(&what)?;
        Revoked::Name(what)
    };
    let failed = |error: String| Error::new(ExitCode::File, error);
    let mut revocations = Revocations::read(list).map_err(failed)?;
    revocations.add(Revocation::now(revoked, reason));
    write_whole(list, revocations.text().map_err(|error| failed(error.to_string()))?.as_bytes())?;
    // Certificates tell the second in which they were made: one that is made after this is to be a later one.
    std::thread::sleep(Duration::from_millis(1100));
    println!("{}", list.display());
    Ok(())
}
