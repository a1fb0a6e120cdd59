//! `tessera release`: lets a node out of quarantine.

use super::{
    client::Access,
    runtime::{block_on, start_logs},
};
use crate::error::Result;

/// Arguments of `tessera release`.
#[derive(clap::Args)]
pub struct Args {
    /// The node's name.
    node: String,
    #[command(flatten)]
    access: Access,
}

/// Runs `tessera release`.
pub fn run(args: Args) -> Result<()> {
    start_logs("error");
    block_on(async {
        let client = args.access.connect().await?;
        client.release(args.node.clone()).await?;
        client.close().await;
        println!("{} may render again", args.node);
        Ok(())
    })
}
