//! The end of a node that is told to go: what its lanes render is finished and handed in, within a limit.

use std::time::Duration;

use tokio::{
    sync::watch,
    time::{Instant, sleep_until},
};

/// What a node that is told to go does next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Say that it drains: it gets nothing new, and what no lane has begun is called back.
    Begin,
    /// Go.
    Go,
}

/// Whether a node is told to go, and since when.
pub struct Drain {
    /// How often it was told: once, and it finishes what its lanes render; twice, and it goes at once.
    told: watch::Receiver<u32>,
    limit: Duration,
    since: Option<Instant>,
}

impl Drain {
    /// A node that was not told to go yet; when it is, it finishes within this limit.
    pub fn new(told: watch::Receiver<u32>, limit: Duration) -> Self {
        Self { told, limit, since: None }
    }

    /// Whether it drains: a new connection is to be told so too.
    pub fn has_begun(&self) -> bool {
        self.since.is_some()
    }

    /// Waits until something is to be done about it; `busy` says whether the node holds anything. It may be given up and called again.
    pub async fn next(&mut self, busy: bool) -> Step {
        let Some(since) = self.since else {
            wait_for(&mut self.told, 1).await;
            self.since = Some(Instant::now());
            return if busy { Step::Begin } else { Step::Go };
        };
        if busy {
            tokio::select! {
                () = wait_for(&mut self.told, 2) => {}
                () = sleep_until(since + self.limit) => {}
            }
        }
        Step::Go
    }
}

/// Waits until a node was told so often. Whoever could tell it may be gone: then nobody will.
async fn wait_for(told: &mut watch::Receiver<u32>, count: u32) {
    if told.wait_for(|told| *told >= count).await.is_err() {
        std::future::pending().await
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn an_idle_node_goes_at_once_and_a_busy_one_when_it_is_done_or_out_of_time() {
        let (short, long) = (Duration::from_millis(100), Duration::from_secs(3600));
        let (tell, told) = watch::channel(0);
        let mut idle = Drain::new(told.clone(), long);
        let (mut done, mut slow, mut hurried) = (Drain::new(told.clone(), long), Drain::new(told.clone(), short), Drain::new(told, long));
        tell.send_replace(1);
        assert_eq!(idle.next(false).await, Step::Go);
        for drain in [&mut done, &mut slow, &mut hurried] {
            assert!(!drain.has_begun());
            assert_eq!(drain.next(true).await, Step::Begin);
            assert!(drain.has_begun());
        }
        assert_eq!(done.next(false).await, Step::Go);
        let begin = Instant::now();
        assert_eq!(slow.next(true).await, Step::Go);
        assert!(begin.elapsed() >= short / 2, "it went before its time");
        tell.send_replace(2);
        assert_eq!(hurried.next(true).await, Step::Go); // an hour early
    }
}
