//! Lanes: the threads that render. They run below the priority of the network's thread, so that no load makes a node look dead.

use std::{
    any::Any,
    collections::VecDeque,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{Arc, Condvar, Mutex, PoisonError},
    thread,
};

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::limits::LANE_NICENESS;

type Task = Box<dyn FnOnce() + Send>;

/// A node's lanes and the tasks that wait for them.
#[derive(Clone)]
pub struct Lanes {
    queue: Arc<Queue>,
    /// As many threads, for work that one lane alone would keep the others waiting with.
    helpers: Arc<ThreadPool>,
}

#[derive(Default)]
struct Queue {
    tasks: Mutex<Tasks>,
    added: Condvar,
}

#[derive(Default)]
struct Tasks {
    first: VecDeque<Task>,
    rest: VecDeque<Task>,
}

impl Lanes {
    /// Starts `count` threads. They end with the process.
    ///
    /// # Errors
    /// When the system gives no more threads.
    pub fn start(count: u32) -> std::io::Result<Self> {
        let queue = Arc::new(Queue::default());
        for lane in 0..count {
            let queue = queue.clone();
            thread::Builder::new().name(format!("lane {lane}")).spawn(move || queue.work())?;
        }
        let lower_priority = |_| _ = rustix::process::nice(LANE_NICENESS);
        let helpers = ThreadPoolBuilder::new().num_threads(count as usize).thread_name(|at| format!("helper {at}"));
        let helpers = helpers.start_handler(lower_priority).build().map_err(std::io::Error::other)?;
        Ok(Self { queue, helpers: Arc::new(helpers) })
    }

    /// Work for a lane that is shared out, as far as it can be, among as many threads as there are lanes.
    pub fn shared<T: Send>(&self, work: impl FnOnce() -> T + Send + 'static) -> impl FnOnce() -> T + Send + 'static {
        let helpers = self.helpers.clone();
        move || helpers.install(work)
    }

    /// Adds work behind what waits, and what is to be done with its result; a panic of the work is an error in words. What bounds the queue
    /// is the coordinator, who hands out a few parts a lane.
    pub fn add<T>(&self, work: impl FnOnce() -> T + Send + 'static, answer: impl FnOnce(Result<T, String>) + Send + 'static) {
        self.put(|tasks| &mut tasks.rest, work, answer);
    }

    /// The same for what a job cannot begin without: before all parts that wait, so that the parts of another job do not keep it from its place in the queue.
    pub fn add_first<T>(&self, work: impl FnOnce() -> T + Send + 'static, answer: impl FnOnce(Result<T, String>) + Send + 'static) {
        self.put(|tasks| &mut tasks.first, work, answer);
    }

    fn put<T>(
        &self,
        place: impl FnOnce(&mut Tasks) -> &mut VecDeque<Task>,
        work: impl FnOnce() -> T + Send + 'static,
        answer: impl FnOnce(Result<T, String>) + Send + 'static,
    ) {
        let task =
            move || answer(catch_unwind(AssertUnwindSafe(work)).map_err(|panic| format!("a fault of the renderer: {}", words(&*panic))));
        place(&mut self.queue.tasks.lock().unwrap_or_else(PoisonError::into_inner)).push_back(Box::new(task));
        self.queue.added.notify_one();
    }
}

impl Queue {
    fn work(&self) {
        // A priority that cannot be lowered does no harm.
        let _ = rustix::process::nice(LANE_NICENESS);
        loop {
            self.next()();
        }
    }

    fn next(&self) -> Task {
        let mut tasks = self.tasks.lock().unwrap_or_else(PoisonError::into_inner);
        loop {
            match tasks.first.pop_front().or_else(|| tasks.rest.pop_front()) {
                Some(task) => return task,
                None => tasks = self.added.wait(tasks).unwrap_or_else(PoisonError::into_inner),
            }
        }
    }
}

fn words(panic: &(dyn Any + Send)) -> &str {
    panic.downcast_ref::<&str>().copied().or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("no reason given")
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use super::*;

    #[test]
    fn a_panic_is_an_answer_and_the_lane_goes_on() {
        let lanes = Lanes::start(1).unwrap();
        let (answers, received) = mpsc::channel();
        let sender = answers.clone();
        lanes.add(|| panic!("no {}", "luck"), move |result: Result<u32, String>| sender.send(result).unwrap());
        lanes.add(|| 7, move |result| answers.send(result).unwrap());
        assert_eq!(received.recv().unwrap(), Err("a fault of the renderer: no luck".to_owned()));
        assert_eq!(received.recv().unwrap(), Ok(7));
    }

    #[test]
    fn what_a_job_begins_with_comes_before_parts_that_wait() {
        let lanes = Lanes::start(1).unwrap();
        let (hold, held) = mpsc::channel::<()>();
        let (sender, done) = mpsc::channel();
        lanes.add(move || held.recv(), |_| ());
        for (name, is_first) in [("part", false), ("another part", false), ("scene", true), ("probe", true)] {
            let sender = sender.clone();
            let answer = move |result: Result<&'static str, String>| sender.send(result.unwrap()).unwrap();
            if is_first { lanes.add_first(move || name, answer) } else { lanes.add(move || name, answer) }
        }
        hold.send(()).unwrap();
        assert_eq!(done.iter().take(4).collect::<Vec<_>>(), ["scene", "probe", "part", "another part"]);
    }
}
