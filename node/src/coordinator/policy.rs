//! The threads on which jobs' own policies think, one a job, so that neither their time nor their virtual machines touch the core or one another.

use std::{
    collections::{BTreeMap, btree_map::Entry},
    sync::mpsc::{self, Receiver, Sender},
    thread,
};

use tokio::sync::mpsc::Sender as InputSender;

use super::input::Input;
use crate::{
    farm::{Answer, Event, JobId, PolicyId, Question},
    job::{JobDescription, Policies, ScriptBundle},
    limits::{POLICY_TIMEOUT, REDISTRIBUTE_POLICY_TIMEOUT},
};

/// The way to the thinking threads.
pub struct Thinker {
    inputs: InputSender<Input>,
    jobs: BTreeMap<JobId, Sender<(PolicyId, Question)>>,
}

impl Thinker {
    /// Answers go to `inputs`.
    pub fn new(inputs: InputSender<Input>) -> Self {
        Self { inputs, jobs: BTreeMap::new() }
    }

    /// Makes a job's policies ready to be asked, if it has any: for a job that begins, as each costs a virtual machine.
    pub fn load(&mut self, job: JobId, description: &JobDescription) {
        if let (Some(script), Entry::Vacant(place)) = (&description.script, self.jobs.entry(job)) {
            let (questions, received) = mpsc::channel();
            let (script, parameters, inputs) = (script.clone(), description.parameters.clone(), self.inputs.clone());
            match thread::Builder::new().name("policies".to_owned()).spawn(move || think(&script, &parameters, &received, &inputs)) {
                Ok(_) => _ = place.insert(questions),
                Err(error) => tracing::error!(job = job.0, %error, "no thread for the job's own policies"),
            }
        }
    }

    /// Asks; the answer comes as [`Event::PolicyAnswered`].
    pub fn ask(&self, id: PolicyId, job: JobId, question: Question) {
        if self.jobs.get(&job).is_none_or(|questions| questions.send((id, question)).is_err()) {
            // The core's own deadline for the answer decides what happens then.
            tracing::error!(job = job.0, "the job's own policies cannot be asked");
        }
    }

    /// A job is over.
    pub fn forget(&mut self, job: JobId) {
        self.jobs.remove(&job);
    }
}

/// Runs the script once more, then answers until the job is forgotten.
fn think(
    script: &ScriptBundle,
    parameters: &BTreeMap<String, String>,
    questions: &Receiver<(PolicyId, Question)>,
    inputs: &InputSender<Input>,
) {
    let mut policies = Policies::new(script, parameters).map_err(|error| error.to_string());
    while let Ok((id, question)) = questions.recv() {
        let answer = policies.as_mut().map_err(|error| error.clone()).and_then(|policies| answer(policies, &question));
        if inputs.blocking_send(Input::Event(Event::PolicyAnswered { id, answer })).is_err() {
            return;
        }
    }
}

fn answer(policies: &mut Policies, question: &Question) -> Result<Answer, String> {
    match question {
        Question::Split { width, height, costs, nodes } => policies.split(*width, *height, costs, nodes, POLICY_TIMEOUT).map(Answer::Split),
        Question::Assign { parts, nodes } => policies.assign(parts, nodes, POLICY_TIMEOUT).map(Answer::Plan),
        Question::Redistribute { parts, nodes } => policies.assign(parts, nodes, REDISTRIBUTE_POLICY_TIMEOUT).map(Answer::Plan),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        job::load,
        schedule::{NodeId, NodePower, evaluate},
    };

    const SCRIPT: &str = r#"
        local tessera = require("tessera")
        return tessera.job {
            scene = tessera.scene { objects = { tessera.sphere { material = tessera.diffuse {} } } },
            film = { width = 4, height = 3 },
            split = function(frame) return { { x = 0, y = 0, width = frame.width, height = frame.height } } end,
        }
    "#;

    /// Otherwise one job's script could fail another job.
    #[tokio::test]
    async fn a_script_that_takes_long_holds_up_no_other_job() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("job.lua");
        std::fs::write(&path, SCRIPT).unwrap();
        let quick = load(&path, &BTreeMap::new()).unwrap().0.description;
        let mut slow = quick.clone();
        slow.script.as_mut().unwrap().source = "while true do end".to_owned();

        let (inputs, mut received) = tokio::sync::mpsc::channel(8);
        let mut thinker = Thinker::new(inputs);
        let power = NodePower { id: NodeId(0), name: "attic".to_owned(), lanes: 1, power: 1.0 };
        let question = Question::Split { width: 4, height: 3, costs: evaluate::uniform(4, 3), nodes: vec![power] };
        for (job, description) in [(JobId(1), &slow), (JobId(2), &quick)] {
            thinker.load(job, description);
            thinker.ask(PolicyId(job.0), job, question.clone());
        }
        let Some(Input::Event(Event::PolicyAnswered { id, answer })) = received.recv().await else { panic!("no answer") };
        assert_eq!(id, PolicyId(2), "{answer:?}");
        assert!(answer.is_ok(), "{answer:?}");
    }
}
