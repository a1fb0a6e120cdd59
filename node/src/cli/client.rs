//! What clients ask a coordinator.

use std::{
    collections::BTreeMap,
    fs,
    io::Write,
    path::{Path, PathBuf},
    sync::{Mutex, MutexGuard, PoisonError},
};

use quinn::{RecvStream, SendStream};
use tessera_engine::description::{AssetId, AssetSource, MemoryAssets};
use tokio::io::AsyncWriteExt;

use super::{link::Link, progress::Progress};
use crate::{
    error::{Error, ExitCode, Result},
    farm::JobId,
    job::JobDescription,
    limits::{FILE_BYTES, READ_CHUNK_BYTES, REQUEST_BYTES, RESPONSE_BYTES, SUBMISSIONS},
    wire::{self, FileHeader, JobState, KeptJob, Place, Request, Response, Status, Terms, tls::Identity},
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
    link: Link,
    /// Names and moments of submission of jobs.
    known: Mutex<BTreeMap<JobId, (String, u64)>>,
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
        Ok(Self { link: Link::new(address, identity).await?, known: Mutex::default(), assets: None })
    }

    /// Puts assets into this folder, where its coordinator has its own: what is there need not be sent.
    pub fn beside(self, assets: PathBuf) -> Self {
        Self { assets: Some(assets), ..self }
    }

    /// Ends the connection.
    pub async fn close(&self) {
        self.link.close().await;
    }

    /// Submits a job, a few times if the coordinator goes away and comes back meanwhile, and returns its number.
    ///
    /// # Errors
    /// When the coordinator refuses the job or is lost for long.
    pub async fn submit_patiently(
        &self,
        description: &JobDescription,
        assets: &MemoryAssets,
        terms: &Terms,
        progress: &Progress,
    ) -> Result<JobId> {
        for _ in 1..SUBMISSIONS {
            match self.submit(description, assets, terms).await {
                Err(error) if self.may_return() && self.link.is_down() => {
                    self.link
                        .restore("to submit the job again (`tessera list` shows whether it was taken already)", error, progress)
                        .await?;
                    let before = self.lock_known().keys().next().copied();
                    if let Some(job) = before {
                        self.recognise(job).await?;
                    }
                }
                done => return done,
            }
        }
        self.submit(description, assets, terms).await
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
            Response::Submitted { job } => {
                if self.may_return() && self.lock_known().is_empty() {
                    // If it is lost now, the job is taken all the same.
                    let _ = self.recognise(job).await;
                }
                Ok(job)
            }
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

    /// Follows a job to its end, and shows how it fares.
    ///
    /// # Errors
    /// When there is no such job, or the coordinator is lost for long.
    pub async fn watch(&self, job: JobId, progress: &mut Progress) -> Result<JobState> {
        self.persist(job, progress, async |progress| self.watched(job, progress).await).await
    }

    async fn watched(&self, job: JobId, progress: &mut Progress) -> Result<JobState> {
        let (_send, mut receive) = self.request(&Request::Watch { job }).await?;
        loop {
            match self.response(&mut receive).await? {
                Response::Job(status, nodes) => {
                    progress.see(&status, &nodes);
                    if status.state.is_over() {
                        return Ok(status.state);
                    }
                }
                other => return Err(self.unexpected(&other)),
            }
        }
    }

    /// Asks something about a job, and again each time that the coordinator has gone away and come back: the job outlives that.
    async fn persist<T>(&self, job: JobId, progress: &mut Progress, mut ask: impl AsyncFnMut(&mut Progress) -> Result<T>) -> Result<T> {
        if !self.may_return() {
            return ask(progress).await;
        }
        let mut is_sure = self.known(job).is_some();
        loop {
            let asked = async {
                if !is_sure {
                    self.recognise(job).await?;
                }
                ask(progress).await
            };
            match asked.await {
                Err(error) if self.link.is_down() => {
                    let what = format!("with job {}", job.0);
                    self.link.restore(&what, error, progress).await.map_err(|error| going_on(error, job, job))?;
                    is_sure = false;
                }
                done => return done,
            }
        }
    }

    /// Whether the coordinator may come back once it has gone: one in this process does not.
    fn may_return(&self) -> bool {
        self.assets.is_none()
    }

    fn lock_known(&self) -> MutexGuard<'_, BTreeMap<JobId, (String, u64)>> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A job's name and moment of submission.
    fn known(&self, job: JobId) -> Option<(String, u64)> {
        self.lock_known().get(&job).cloned()
    }

    /// Sees that the coordinator has the job that it had before: one whose folder is another one gives the same numbers to others.
    async fn recognise(&self, job: JobId) -> Result<()> {
        let (known, kept) = (self.known(job), self.list().await);
        // Where there is nothing to compare with, there is nothing to miss.
        let found = match kept {
            Err(_) if known.is_none() && !self.link.is_down() => return Ok(()),
            kept => kept?.into_iter().map(|kept| (kept.job, (kept.name, kept.submitted))).collect::<BTreeMap<_, _>>(),
        };
        match known {
            None => {
                // All at once: of the frames of a sequence each will be asked for.
                let mut known = self.lock_known();
                found.into_iter().for_each(|(job, is)| _ = known.entry(job).or_insert(is));
                Ok(())
            }
            Some(known) if found.get(&job) != Some(&known) => {
                let message = format!("the coordinator at {} does not have job {} ({}) any more", self.link.address(), job.0, known.0);
                Err(Error::new(ExitCode::Farm, message)
                    .with_help("it was deleted, or the coordinator's folder is another one; `tessera list` shows what there is"))
            }
            Some(_) => Ok(()),
        }
    }

    /// Whether somebody has waited in vain for the coordinator to come back.
    pub fn has_given_up(&self) -> bool {
        self.link.has_given_up()
    }

    /// Fetches a job's files into a folder. They take their names when all are there.
    ///
    /// # Errors
    /// When there are none, when the folder cannot be written, or when the coordinator is lost for long.
    pub async fn fetch(&self, job: JobId, folder: &Path, progress: &mut Progress) -> Result<Vec<PathBuf>> {
        self.persist(job, progress, async |_| self.fetched(job, folder).await).await
    }

    async fn fetched(&self, job: JobId, folder: &Path) -> Result<Vec<PathBuf>> {
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
        let (mut send, receive) = self.link.connection().open_bi().await.map_err(|error| self.lost(error))?;
        wire::write(&mut send, request, REQUEST_BYTES).await.map_err(|error| self.lost(error))?;
        Ok((send, receive))
    }

    async fn response(&self, receive: &mut RecvStream) -> Result<Response> {
        wire::read(receive, RESPONSE_BYTES).await.map_err(|error| self.lost(error))
    }

    fn lost(&self, error: impl std::fmt::Display) -> Error {
        self.link.lost(error)
    }

    fn unexpected(&self, response: &Response) -> Error {
        match response {
            Response::Refused { reason } => {
                Error::new(ExitCode::Farm, format!("the coordinator at {} refuses: {reason}", self.link.address()))
            }
            Response::Denied { reason } => {
                Error::new(ExitCode::Denied, format!("the coordinator at {} refuses: {reason}", self.link.address()))
            }
            _ => Error::new(ExitCode::Farm, format!("the coordinator at {} answers something else", self.link.address())),
        }
    }
}

/// An error of who waited in vain for a coordinator, with what can be done for jobs, from the first to the last, when it is back.
pub fn going_on(error: Error, first: JobId, last: JobId) -> Error {
    if error.code == ExitCode::Denied {
        return error;
    }
    let (range, number) =
        if first == last { (String::new(), first.0.to_string()) } else { (format!(" {} to {}", first.0, last.0), "JOB".to_owned()) };
    error.with_help(format!(
        "when it is back, `tessera watch {number}` follows what is left{range}, and `tessera fetch {number}` brings its files"
    ))
}

fn unwritable(path: &Path, error: &std::io::Error) -> Error {
    Error::new(ExitCode::File, format!("{}: cannot be written: {error}", path.display()))
}

/// Files of one's own, readable by others as the umask says.
fn plain_permissions() -> fs::Permissions {
    std::os::unix::fs::PermissionsExt::from_mode(0o666)
}
