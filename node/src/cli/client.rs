//! A client's connection to a coordinator.

use std::{
    fs,
    io::Write,
    net::{SocketAddr, ToSocketAddrs},
    path::{Path, PathBuf},
};

use quinn::{Connection, Endpoint, RecvStream, SendStream};
use tessera_engine::description::{AssetId, AssetSource, MemoryAssets};
use tokio::{
    io::AsyncWriteExt,
    time::{sleep, timeout},
};

use crate::{
    error::{Error, ExitCode, Result},
    farm::JobId,
    job::JobDescription,
    limits::{CONNECT_TIMEOUT, FAREWELL, FILE_BYTES, READ_CHUNK_BYTES, REQUEST_BYTES, RESPONSE_BYTES, SILENCE_SAID_AFTER},
    wire::{self, FileHeader, JobState, JobStatus, KeptJob, NodeStatus, Place, Refusal, Request, Response, Status, Terms, tls::Identity},
};

/// How subcommands find their coordinator.
#[derive(clap::Args)]
pub struct Access {
    /// Host and port of the coordinator.
    #[arg(long, env = "TESSERA_COORDINATOR", value_name = "HOST:PORT")]
    pub coordinator: String,
    /// The client's identity: a file made by `tessera keys`, or a folder that holds one.
    #[arg(long, env = "TESSERA_KEYS", value_name = "PATH")]
    pub keys: PathBuf,
}

impl Access {
    /// Connects.
    ///
    /// # Errors
    /// As [`Client::connect`], and when the identity cannot be read.
    pub async fn connect(&self) -> Result<Client> {
        Client::connect(&self.coordinator, &Identity::load_client(&self.keys)?).await
    }
}

/// A job's number on the command line.
///
/// # Errors
/// In words, when it is none.
pub fn job_number(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| "a job's number is expected, as `tessera submit` prints it and `tessera list` shows it".to_owned())
}

/// Jobs on the command line.
#[derive(clap::Args)]
pub struct Jobs {
    /// Numbers of jobs, or ranges of them such as 12-36.
    #[arg(required = true, value_name = "JOB", value_parser = job_range)]
    jobs: Vec<(u64, u64)>,
}

impl Jobs {
    /// Their numbers, in the order in which they were given.
    pub fn numbers(&self) -> impl Iterator<Item = JobId> + '_ {
        self.jobs.iter().flat_map(|(first, last)| *first..=*last).map(JobId)
    }
}

/// Does the same with several jobs, and tells of each: what fails for one is tried for the others all the same.
///
/// # Errors
/// The first that there is.
pub async fn each_job<F: Future<Output = Result<()>>>(jobs: &Jobs, said: &str, act: impl Fn(JobId) -> F) -> Result<()> {
    let mut failed = None;
    for job in jobs.numbers() {
        match act(job).await {
            Ok(()) => println!("job {} {said}", job.0),
            Err(error) if failed.is_none() => failed = Some(error),
            Err(error) => eprintln!("error: {error}"),
        }
    }
    failed.map_or(Ok(()), Err)
}

/// Writes a job's assets into a folder, each whole or not at all. What cannot be written will be sent.
fn put_assets(folder: &Path, description: &JobDescription, assets: &MemoryAssets) {
    for (id, path) in description.assets.iter().map(|id| (id, folder.join(id.to_string()))).filter(|(_, path)| !path.exists()) {
        let Some((bytes, mut file)) = assets.bytes(*id).zip(tempfile::NamedTempFile::new_in(folder).ok()) else { continue };
        if file.write_all(&bytes).is_ok() {
            let _ = file.persist(path);
        }
    }
}

fn job_range(text: &str) -> Result<(u64, u64), String> {
    let (first, last) = text.split_once('-').unwrap_or((text, text));
    let (first, last) = (job_number(first)?, job_number(last)?);
    if first <= last { Ok((first, last)) } else { Err(format!("the range ends before it begins; {last}-{first} is meant, perhaps")) }
}

/// A connection to a coordinator.
pub struct Client {
    endpoint: Endpoint,
    connection: Connection,
    address: String,
    /// Where the coordinator has its assets, if that is known and this machine's.
    assets: Option<PathBuf>,
}

impl Client {
    /// Connects.
    ///
    /// # Errors
    /// When the coordinator cannot be reached, or either side refuses the other's certificate.
    pub async fn connect(address: &str, identity: &Identity) -> Result<Self> {
        if let Some(warning) = identity.warning() {
            eprintln!("warning: {warning}");
        }
        let socket = resolve(address).map_err(|error| unreachable(address, Refusal::other(error)))?;
        let endpoint = wire::client(identity, socket)?;
        let connecting = patiently(address, timeout(CONNECT_TIMEOUT, wire::connect(&endpoint, socket))).await;
        let late = || Err(Refusal::other(format!("no answer within {} s", CONNECT_TIMEOUT.as_secs())));
        let connection = connecting.unwrap_or_else(|_| late()).map_err(|refusal| unreachable(address, refusal))?;
        Ok(Self { endpoint, connection, address: address.to_owned(), assets: None })
    }

    /// Puts assets into this folder, where its coordinator has its own: what is there need not be sent.
    pub fn beside(self, assets: PathBuf) -> Self {
        Self { assets: Some(assets), ..self }
    }

    /// Ends the connection.
    pub async fn close(&self) {
        self.connection.close(0_u8.into(), b"");
        let _ = timeout(FAREWELL, self.endpoint.wait_idle()).await;
    }

    /// Submits a job with the assets that the coordinator does not have, and returns its number.
    ///
    /// # Errors
    /// When the coordinator refuses the job or is lost.
    pub async fn submit(&self, description: &JobDescription, assets: &MemoryAssets, terms: &Terms) -> Result<JobId> {
        if let Some(folder) = &self.assets {
            tokio::task::block_in_place(|| put_assets(folder, description, assets));
        }
        let request = Request::Submit { description: Box::new(description.clone()), terms: terms.clone() };
        let (mut send, mut receive) = self.request(&request).await?;
        let wanted = match self.response(&mut receive).await? {
            Response::Wanted(wanted) => wanted,
            other => return Err(self.unexpected(&other)),
        };
        // An answer that comes before all is sent is a refusal, and ends the sending.
        let answer = self.response(&mut receive);
        tokio::pin!(answer);
        let answer = tokio::select! {
            biased;
            answer = &mut answer => answer,
            sent = self.send_assets(&mut send, assets, wanted) => match (sent, answer.await) {
                (Err(error), Err(_)) => Err(error),
                (_, answer) => answer,
            },
        };
        match answer? {
            Response::Submitted { job } => Ok(job),
            other => Err(self.unexpected(&other)),
        }
    }

    async fn send_assets(&self, send: &mut SendStream, assets: &MemoryAssets, wanted: Vec<AssetId>) -> Result<()> {
        for id in wanted {
            let bytes =
                assets.bytes(id).ok_or_else(|| Error::new(ExitCode::Internal, format!("the job names asset {id}, which is not in it")))?;
            send.write_u64_le(bytes.len() as u64).await.map_err(|error| self.lost(error))?;
            send.write_all(&bytes).await.map_err(|error| self.lost(error))?;
        }
        Ok(())
    }

    /// Follows a job to its end; `see` is told of every change.
    ///
    /// # Errors
    /// When there is no such job, or the coordinator is lost.
    pub async fn watch(&self, job: JobId, mut see: impl FnMut(&JobStatus, &[NodeStatus])) -> Result<JobState> {
        let (_send, mut receive) = self.request(&Request::Watch { job }).await?;
        loop {
            match self.response(&mut receive).await? {
                Response::Job(status, nodes) => {
                    see(&status, &nodes);
                    if status.state.is_over() {
                        return Ok(status.state);
                    }
                }
                other => return Err(self.unexpected(&other)),
            }
        }
    }

    /// Fetches a job's files into a folder. They take their names when all are there.
    ///
    /// # Errors
    /// When there are none, when the folder cannot be written, or when the coordinator is lost.
    pub async fn fetch(&self, job: JobId, folder: &Path) -> Result<Vec<PathBuf>> {
        let (_send, mut receive) = self.request(&Request::Fetch { job }).await?;
        let headers = match self.response(&mut receive).await? {
            Response::Files(headers) => headers,
            other => return Err(self.unexpected(&other)),
        };
        let mut files = Vec::new();
        for header in headers {
            if !wire::is_plain_name(&header.name) || header.length > FILE_BYTES {
                return Err(Error::new(
                    ExitCode::Farm,
                    format!("the coordinator names a file {:?} of {} bytes", header.name, header.length),
                ));
            }
            files.push((folder.join(&header.name), self.receive(&mut receive, &header, folder).await?));
        }
        let mut paths = Vec::new();
        for (path, file) in files {
            file.persist(&path).map_err(|error| unwritable(&path, &error.error))?;
            paths.push(path);
        }
        fs::File::open(folder).and_then(|folder| folder.sync_all()).map_err(|error| unwritable(folder, &error))?;
        Ok(paths)
    }

    async fn receive(&self, receive: &mut RecvStream, header: &FileHeader, folder: &Path) -> Result<tempfile::NamedTempFile> {
        let refused = |error: std::io::Error| unwritable(&folder.join(&header.name), &error);
        let mut file = tempfile::Builder::new().permissions(plain_permissions()).tempfile_in(folder).map_err(refused)?;
        let mut chunk = vec![0; READ_CHUNK_BYTES];
        let mut left = header.length;
        while left > 0 {
            let wanted = usize::try_from(left).unwrap_or(READ_CHUNK_BYTES).min(READ_CHUNK_BYTES);
            receive.read_exact(&mut chunk[..wanted]).await.map_err(|error| self.lost(error))?;
            file.write_all(&chunk[..wanted]).map_err(refused)?;
            left -= wanted as u64;
        }
        file.as_file().sync_all().map_err(refused)?;
        Ok(file)
    }

    /// Nodes and jobs.
    ///
    /// # Errors
    /// When the coordinator is lost.
    pub async fn status(&self) -> Result<Status> {
        let (_send, mut receive) = self.request(&Request::Status).await?;
        match self.response(&mut receive).await? {
            Response::Status(status) => Ok(status),
            other => Err(self.unexpected(&other)),
        }
    }

    /// Ends a job.
    ///
    /// # Errors
    /// When it neither runs nor waits, or the coordinator is lost.
    pub async fn cancel(&self, job: JobId) -> Result<()> {
        let (_send, mut receive) = self.request(&Request::Cancel { job }).await?;
        match self.response(&mut receive).await? {
            Response::Done => Ok(()),
            other => Err(self.unexpected(&other)),
        }
    }

    /// Gives a job another place in the queue.
    ///
    /// # Errors
    /// When it neither runs nor waits, or the coordinator is lost.
    pub async fn move_job(&self, job: JobId, place: Place) -> Result<()> {
        let (_send, mut receive) = self.request(&Request::Move { job, place }).await?;
        match self.response(&mut receive).await? {
            Response::Done => Ok(()),
            other => Err(self.unexpected(&other)),
        }
    }

    /// Lets a node out of quarantine.
    ///
    /// # Errors
    /// When it is in none, or the coordinator is lost.
    pub async fn release(&self, node: String) -> Result<()> {
        let (_send, mut receive) = self.request(&Request::Release { node }).await?;
        match self.response(&mut receive).await? {
            Response::Done => Ok(()),
            other => Err(self.unexpected(&other)),
        }
    }

    /// Jobs that are kept.
    ///
    /// # Errors
    /// When the coordinator is lost, or cannot read its folder.
    pub async fn list(&self) -> Result<Vec<KeptJob>> {
        let (_send, mut receive) = self.request(&Request::List).await?;
        match self.response(&mut receive).await? {
            Response::Jobs(jobs) => Ok(jobs),
            other => Err(self.unexpected(&other)),
        }
    }

    /// Deletes a job.
    ///
    /// # Errors
    /// When it waits or runs, when there is none, or the coordinator is lost.
    pub async fn delete(&self, job: JobId) -> Result<()> {
        let (_send, mut receive) = self.request(&Request::Delete { job }).await?;
        match self.response(&mut receive).await? {
            Response::Done => Ok(()),
            other => Err(self.unexpected(&other)),
        }
    }

    async fn request(&self, request: &Request) -> Result<(SendStream, RecvStream)> {
        let (mut send, receive) = self.connection.open_bi().await.map_err(|error| self.lost(error))?;
        wire::write(&mut send, request, REQUEST_BYTES).await.map_err(|error| self.lost(error))?;
        Ok((send, receive))
    }

    async fn response(&self, receive: &mut RecvStream) -> Result<Response> {
        wire::read(receive, RESPONSE_BYTES).await.map_err(|error| self.lost(error))
    }

    fn lost(&self, error: impl std::fmt::Display) -> Error {
        let refusal = self.connection.close_reason().map_or_else(|| Refusal::other(error.to_string()), |reason| wire::explain(&reason));
        if refusal.denied {
            return unreachable(&self.address, refusal);
        }
        Error::new(ExitCode::Farm, format!("the coordinator at {} is lost: {refusal}", self.address))
    }

    fn unexpected(&self, response: &Response) -> Error {
        match response {
            Response::Refused { reason } => Error::new(ExitCode::Farm, format!("the coordinator at {} refuses: {reason}", self.address)),
            Response::Denied { reason } => Error::new(ExitCode::Denied, format!("the coordinator at {} refuses: {reason}", self.address)),
            _ => Error::new(ExitCode::Farm, format!("the coordinator at {} answers something else", self.address)),
        }
    }
}

/// No connection, and why.
pub fn unreachable(address: &str, refusal: Refusal) -> Error {
    let (code, what) = if refusal.denied { (ExitCode::Denied, "refused at") } else { (ExitCode::Farm, "cannot reach the coordinator at") };
    Error::new(code, format!("{what} {address}: {}", refusal.message))
        .with_help(refusal.help.unwrap_or("check the address, that the coordinator runs, and that the keys are of its farm"))
}

/// Waits for a connection, and says so where that takes long.
async fn patiently<T>(address: &str, connecting: impl Future<Output = T>) -> T {
    tokio::pin!(connecting);
    tokio::select! {
        done = &mut connecting => return done,
        () = sleep(SILENCE_SAID_AFTER) => {}
    }
    eprintln!("connecting to {address}: no answer yet");
    connecting.await
}

fn unwritable(path: &Path, error: &std::io::Error) -> Error {
    Error::new(ExitCode::File, format!("{}: cannot be written: {error}", path.display()))
}

/// Files of one's own, readable by others as the umask says.
fn plain_permissions() -> fs::Permissions {
    std::os::unix::fs::PermissionsExt::from_mode(0o666)
}

/// The address of a host and port.
///
/// # Errors
/// In words, when it has none.
pub fn resolve(address: &str) -> Result<SocketAddr, String> {
    let mut found = address.to_socket_addrs().map_err(|error| match error.kind() {
        std::io::ErrorKind::InvalidInput => "it is not HOST:PORT, such as lead:7143".to_owned(),
        _ => error.to_string(),
    })?;
    found.next().ok_or_else(|| "it has no address".to_owned())
}
