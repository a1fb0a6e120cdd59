//! What clients ask for, and what their roles let them do.

use std::{io, path::Path, sync::Arc};

use quinn::{RecvStream, SendStream};
use tokio::{
    io::AsyncWriteExt,
    sync::{Semaphore, oneshot},
};

use super::{Shared, gate::Guest, housekeeping, input::Input, kept::Kept, submission};
use crate::{
    farm::JobId,
    job::JobDescription,
    limits::{ASSET_LEAST_BYTES, REQUEST_BYTES, RESPONSE_BYTES},
    wire::{
        self, FileHeader, FrameError, JobState, KeptJob, Place, Request, Response, Terms,
        tls::{Deed, Peer, Role},
    },
};

/// Serves a client until its connection ends.
pub async fn serve(shared: Shared, guest: Guest) {
    loop {
        let (send, receive) = tokio::select! {
            accepted = guest.connection.accept_bi() => match accepted {
                Ok(streams) => streams,
                Err(_) => return,
            },
            _ = guest.turned_away() => return,
        };
        let (shared, client, turn) = (shared.clone(), guest.peer().clone(), guest.turn.clone());
        tokio::spawn(async move {
            if let Err(error) = answer(&shared, &client, &turn, send, receive).await {
                tracing::info!(%client, %error, "a request was not answered to its end");
            }
        });
    }
}

async fn answer(
    shared: &Shared,
    client: &Peer,
    turn: &Arc<Semaphore>,
    mut send: SendStream,
    mut receive: RecvStream,
) -> Result<(), FrameError> {
    let (request, room) = shared.room.read_now::<Request>(&mut receive, REQUEST_BYTES, turn).await?;
    if let Err(reason) = permit(shared, client, &request) {
        tracing::warn!(%client, reason, "a request was refused");
        say(&mut send, &Response::Denied { reason }).await?;
        return send.finish().map_err(|error| io::Error::other(error).into());
    }
    match request {
        Request::Submit { description, terms } => {
            // Assets may take hours: others are not to wait for them, but another submission of this client does.
            drop(room);
            let _turn = turn.acquire().await;
            submit(shared, client, description, terms, &mut send, &mut receive).await?;
        }
        Request::Status => {
            let status = shared.status.borrow().as_ref().clone();
            say(&mut send, &Response::Status(status)).await?;
        }
        Request::List => {
            let listed = list(shared).await;
            say(&mut send, &listed.map_or_else(|reason| Response::Refused { reason }, Response::Jobs)).await?;
        }
        Request::Delete { job } => {
            let deleted = housekeeping::delete(shared, job).await;
            if deleted.is_ok() {
                housekeeping::drop_assets(shared).await;
            }
            say(&mut send, &deleted.map_or_else(|reason| Response::Refused { reason }, |()| Response::Done)).await?;
        }
        Request::Watch { job } => watch(shared, job, &mut send).await?,
        Request::Fetch { job } => fetch(shared, job, &mut send).await?,
        Request::Release { node } => {
            let (reply, answer) = oneshot::channel();
            let done = shared.ask(Input::Release { node, reply }, answer).await;
            say(&mut send, &done.map_or_else(|reason| Response::Refused { reason }, |()| Response::Done)).await?;
        }
        Request::Move { job, place } => {
            let moved = move_job(shared, client, job, place).await;
            say(&mut send, &moved.map_or_else(|reason| Response::Refused { reason }, |()| Response::Done)).await?;
        }
        Request::Cancel { job } => {
            let (reply, answer) = oneshot::channel();
            let cancel = Input::Cancel { job, reason: format!("cancelled by {client}"), reply };
            let done = shared.ask(cancel, answer).await;
            say(&mut send, &done.map_or_else(|reason| Response::Refused { reason }, |()| Response::Done)).await?;
        }
    }
    send.finish().map_err(io::Error::other)?;
    Ok(())
}

async fn move_job(shared: &Shared, client: &Peer, job: JobId, place: Place) -> Result<(), String> {
    if let Place::Ranked(priority) = place {
        submission::check_priority(priority)?;
    }
    let (reply, answer) = oneshot::channel();
    shared.ask(Input::Move { job, place, operator: client.role == Role::Operator, reason: format!("by {client}"), reply }, answer).await
}

/// Operators alone put jobs before those of others.
fn may_rank(client: &Peer, priority: i32) -> Result<(), String> {
    if priority > 0 && client.role != Role::Operator {
        return Err(format!("{client} may not give a job the priority {priority}: above 0 that takes an operator's key"));
    }
    Ok(())
}

/// Whether a client's role lets it ask for this.
fn permit(shared: &Shared, client: &Peer, request: &Request) -> Result<(), String> {
    if let Request::Submit { terms: Terms { priority, .. }, .. } | Request::Move { place: Place::Ranked(priority), .. } = request {
        may_rank(client, *priority)?;
    }
    let (deed, job) = match request {
        Request::Submit { .. } => (Deed::Submit, None),
        Request::Status | Request::List | Request::Watch { .. } => (Deed::Look, None),
        Request::Fetch { job } => (Deed::Fetch, Some(*job)),
        Request::Cancel { job } => (Deed::Cancel, Some(*job)),
        Request::Delete { job } => (Deed::Delete, Some(*job)),
        Request::Release { .. } => (Deed::Release, None),
        Request::Move { job, .. } => (Deed::Move, Some(*job)),
    };
    let owner = job.and_then(|job| shared.store.owner(job));
    if client.role.may(deed, owner.as_ref() == Some(&client.name)) {
        return Ok(());
    }
    match job {
        Some(job) if client.role.may(deed, true) => {
            Err(format!("{client} may {deed} of its own alone, and job {} is not: ask who submitted it, or an operator", job.0))
        }
        _ => Err(format!("{client} may not {deed}: that takes a key of another role")),
    }
}

async fn say(send: &mut SendStream, response: &Response) -> Result<(), FrameError> {
    wire::write(send, response, RESPONSE_BYTES).await
}

async fn submit(
    shared: &Shared,
    client: &Peer,
    description: Box<JobDescription>,
    terms: Terms,
    send: &mut SendStream,
    receive: &mut RecvStream,
) -> Result<(), FrameError> {
    let submitting = shared.store.submitting.clone();
    let _taking = submitting.read().await;
    if let Err(reason) = may_submit(shared, &description, &terms).await {
        return say(send, &Response::Refused { reason }).await;
    }
    let wanted: Vec<_> = description.assets.iter().copied().filter(|id| !shared.store.asset(*id).exists()).collect();
    say(send, &Response::Wanted(wanted.clone())).await?;
    let limited = client.role == Role::Submitter;
    let mut left = if limited { bytes_left(shared, &client.name).await? } else { u64::MAX };
    // Its description is kept twice: with the job, and as the frame that nodes fetch.
    let weight = 2 * postcard::to_stdvec(&description)?.len() as u64;
    for id in wanted {
        match shared.store.receive(id, receive, left.saturating_sub(weight)).await {
            Ok(length) => {
                let length = length.max(ASSET_LEAST_BYTES);
                left = left.saturating_sub(length);
                if limited {
                    shared.quota.add(&client.name, &format!("assets/{id}"), length)?;
                }
            }
            Err(error) if error.kind() == io::ErrorKind::QuotaExceeded => {
                return say(send, &Response::Denied { reason: shared.quota.refusal(&client.name) }).await;
            }
            Err(error) => return say(send, &Response::Refused { reason: format!("an asset could not be taken: {error}") }).await,
        }
    }
    if left < weight {
        return say(send, &Response::Denied { reason: shared.quota.refusal(&client.name) }).await;
    }
    let (reply, answer) = oneshot::channel();
    let submitted = shared.ask(Input::Submit { description, terms, owner: client.name.clone(), limited, reply }, answer).await;
    if let (Ok(job), true) = (&submitted, limited) {
        shared.quota.add(&client.name, &format!("jobs/{}", job.0), weight)?;
    }
    say(send, &submitted.map_or_else(|reason| Response::Refused { reason }, |job| Response::Submitted { job })).await
}

async fn bytes_left(shared: &Shared, owner: &str) -> io::Result<u64> {
    let (quota, owner) = (shared.quota.clone(), owner.to_owned());
    tokio::task::spawn_blocking(move || quota.left(&owner)).await.map_err(io::Error::other)?
}

/// Whether a job is taken: it is as it should be, and there is room for it.
async fn may_submit(shared: &Shared, description: &JobDescription, terms: &Terms) -> Result<(), String> {
    submission::check(description, terms)?;
    shared.status.borrow().refusal.clone().map_or(Ok(()), Err)?;
    let (store, frame) = (shared.store.clone(), &description.frame);
    let pixels = u64::from(frame.film.width) * u64::from(frame.film.height);
    let bytes = pixels.saturating_mul(frame.aovs.bytes_per_pixel());
    tokio::task::spawn_blocking(move || store.room_for(bytes)).await.map_err(|error| error.to_string())?
}

/// All jobs that are kept, those that wait and run among them.
async fn list(shared: &Shared) -> Result<Vec<KeptJob>, String> {
    let (store, status) = (shared.store.clone(), shared.status.borrow().clone());
    let kept = tokio::task::spawn_blocking(move || store.kept()).await.map_err(|error| error.to_string())?;
    let listed = |kept: Kept| {
        let live = status.jobs.iter().find(|job| job.job == kept.job).map(|job| job.state.clone());
        let state = kept.end.map(|end| end.state).or(live).unwrap_or(JobState::Waiting);
        KeptJob { job: kept.job, name: kept.card.name, submitted: kept.card.submitted, state, bytes: kept.bytes }
    };
    kept.map(|kept| kept.into_iter().map(listed).collect()).map_err(|error| error.to_string())
}

async fn watch(shared: &Shared, job: JobId, send: &mut SendStream) -> Result<(), FrameError> {
    let mut status = shared.status.clone();
    let mut last = None;
    loop {
        let now = status.borrow_and_update().clone();
        let Some(found) = now.jobs.iter().find(|found| found.job == job) else {
            return say(
                send,
                &Response::Refused {
                    reason: format!("there is no job {} that waits, runs or has just ended; `tessera list` shows what is kept", job.0),
                },
            )
            .await;
        };
        if last.as_ref() != Some(&(found.clone(), now.nodes.clone())) {
            last = Some((found.clone(), now.nodes.clone()));
            say(send, &Response::Job(found.clone(), now.nodes.clone())).await?;
        }
        if found.state.is_over() || status.changed().await.is_err() {
            return Ok(());
        }
    }
}

async fn fetch(shared: &Shared, job: JobId, send: &mut SendStream) -> Result<(), FrameError> {
    let folder = shared.store.files(job);
    let files = match files(&folder) {
        Ok(files) if !files.is_empty() => files,
        _ => {
            return say(
                send,
                &Response::Refused { reason: format!("there are no files of job {0}; `tessera watch {0}` tells its state", job.0) },
            )
            .await;
        }
    };
    // Open files stay whole, whoever deletes the job meanwhile.
    let mut open = Vec::new();
    for header in &files {
        open.push(tokio::fs::File::open(folder.join(&header.name)).await?);
    }
    say(send, &Response::Files(files)).await?;
    for mut file in open {
        tokio::io::copy(&mut file, send).await?;
    }
    Ok(send.flush().await?)
}

fn files(folder: &Path) -> io::Result<Vec<FileHeader>> {
    let mut files = Vec::new();
    for entry in folder.read_dir()? {
        let entry = entry?;
        if let Some(name) = entry.file_name().to_str().filter(|name| wire::is_plain_name(name)) {
            files.push(FileHeader { name: name.to_owned(), length: entry.metadata()?.len() });
        }
    }
    files.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(files)
}
