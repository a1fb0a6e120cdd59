//! The frame is split and assigned, by built-in policies or by the job's own.

use std::time::Duration;

use serde::{Deserialize, Serialize};
use tessera_engine::part::Rect;

use super::job::{Job, Member, Phase};
use super::node::Nodes;
use super::part::{PartState, Place};
use super::turn::Turn;
use super::{Answer, Command, Farm, Outcome, PolicyId, Question};
use crate::manifest::EventKind;
use crate::schedule::assign::{self, Backlog};
use crate::schedule::{Assign, NodeId, NodePower, Part, PartId, Plan, Split, evaluate, split};

/// A question to the job's own policy.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Pending {
    id: PolicyId,
    pub deadline: Duration,
    question: Question,
}

impl Farm {
    pub(super) fn policy_answered(&mut self, id: PolicyId, answer: Result<Answer, String>) {
        let asked = self.open_jobs().find(|job| job.question.as_ref().is_some_and(|pending| pending.id == id)).map(|job| job.id);
        if let Some(asked) = asked {
            self.with_job(asked, |job, turn, nodes| job.policy_answered(turn, nodes, id, answer));
        }
    }
}

impl Job {
    pub(super) fn advance_planning(&mut self, turn: &mut Turn, nodes: &mut Nodes) {
        if self.phase == Phase::Splitting && self.question.is_none() {
            self.split(turn, nodes);
        }
        if self.phase == Phase::Assigning && self.question.is_none() {
            self.assign(turn, nodes);
        }
    }

    fn split(&mut self, turn: &mut Turn, nodes: &mut Nodes) {
        let (width, height) = (self.spec.width, self.spec.height);
        let rects = match self.spec.split {
            Split::Grid { width: columns, height: rows } => split::grid(width, height, columns, rows),
            Split::Strips { count } => split::strips(width, height, count),
            Split::Script => {
                let powers = self.usable_powers(nodes);
                if !powers.is_empty() {
                    self.ask(turn, Question::Split { width, height, costs: self.costs.clone(), nodes: powers });
                }
                return;
            }
        };
        self.take_split(turn, nodes, rects);
    }

    fn take_split(&mut self, turn: &mut Turn, nodes: &mut Nodes, rects: Vec<Rect>) {
        if let Err(wrong) = split::validate(&rects, self.spec.width, self.spec.height) {
            return self.end(turn, nodes, Outcome::Failed { reason: format!("split: {wrong}") });
        }
        let part = |(id, rect): (u32, &Rect)| PartState::new(PartId(id), *rect, split::cost_of(*rect, &self.costs));
        self.parts = (0..).zip(&rects).map(part).collect();
        self.split_into = self.parts.len();
        self.cost.0 = self.parts.iter().map(|part| part.cost).sum();
        self.loose = self.parts.iter().map(|part| part.id).collect();
        self.phase = Phase::Assigning;
    }

    fn assign(&mut self, turn: &mut Turn, nodes: &mut Nodes) {
        let (parts, powers) = (self.hardest_first(), self.usable_powers(nodes));
        if powers.is_empty() {
            return;
        }
        match self.built_in(nodes, &parts, &powers) {
            Some(plan) => self.begin_rendering(turn, nodes, plan),
            None => self.ask(turn, Question::Assign { parts, nodes: powers }),
        }
    }

    /// Parts with no node, hardest first.
    pub(super) fn hardest_first(&self) -> Vec<Part> {
        let parts: Vec<Part> = self.loose.iter().map(|id| self.part(*id).describe()).collect();
        evaluate::difficulty(&parts).into_iter().map(|id| self.part(id).describe()).collect()
    }

    /// What the job's policy says, where it is a built-in one.
    pub(super) fn built_in(&self, nodes: &Nodes, parts: &[Part], powers: &[NodePower]) -> Option<Plan> {
        match self.spec.assign {
            Assign::Naive => Some(assign::naive(parts, powers)),
            Assign::Paper => Some(assign::paper(parts, powers, &self.backlog(nodes))),
            Assign::EarliestFinish => Some(assign::earliest_finish(parts, powers, &self.backlog(nodes))),
            Assign::Script => None,
        }
    }

    /// Cost that waits at every node, handed out or not.
    pub(super) fn backlog(&self, nodes: &Nodes) -> Backlog {
        let of = |(id, member): (&NodeId, &Member)| {
            let held: f64 = self.held_by(nodes, *id).map(|lease| self.part(lease.part).expected).sum();
            (*id, held + member.queued_cost)
        };
        self.members.iter().map(of).collect()
    }

    fn begin_rendering(&mut self, turn: &mut Turn, nodes: &mut Nodes, plan: Plan) {
        for (part, node) in &plan {
            self.part_mut(*part).planned = Some(*node);
        }
        self.phase = Phase::Rendering;
        self.log.event(turn.now, EventKind::RenderStarted, None, Vec::new(), format!("{} parts", self.parts.len()));
        self.carry_out(nodes, &plan);
    }

    /// Puts parts in the queues of the nodes that a plan gives them to. Parts of nodes that are lost by now stay loose, as do parts that were
    /// delivered meanwhile.
    pub(super) fn carry_out(&mut self, nodes: &mut Nodes, plan: &Plan) {
        let mut touched = std::collections::BTreeSet::new();
        for (part, node) in plan {
            if self.part(*part).place != Place::Loose || !self.usable(nodes, *node) {
                continue;
            }
            self.part_mut(*part).place = Place::Queued(*node);
            self.loose.remove(part);
            self.put_in(*node, *part);
            touched.insert(*node);
        }
        let on_film = self.spec.assign == Assign::Naive;
        for node in touched {
            let Some(member) = self.members.get_mut(&node) else { continue };
            let cost = |part: &PartId| if on_film { 0.0 } else { self.parts[part.0 as usize].cost };
            member.queue.make_contiguous().sort_by(|a, b| cost(b).total_cmp(&cost(a)).then(a.cmp(b)));
        }
    }

    pub(super) fn ask(&mut self, turn: &mut Turn, question: Question) {
        let id = turn.question();
        let timeout = match question {
            Question::Redistribute { .. } => turn.config.redistribute_policy_timeout,
            _ => turn.config.policy_timeout,
        };
        self.question = Some(Pending { id, deadline: turn.now + timeout, question: question.clone() });
        turn.put(Command::AskPolicy { id, job: self.id, question });
    }

    /// The job's own policy answered. Answers that come too late name a question that is not asked any more.
    pub fn policy_answered(&mut self, turn: &mut Turn, nodes: &mut Nodes, id: PolicyId, answer: Result<Answer, String>) {
        if let Some(pending) = self.question.take_if(|pending| pending.id == id) {
            self.take_answer(turn, nodes, &pending.question, answer);
        }
    }

    pub(super) fn watch_question(&mut self, turn: &mut Turn, nodes: &mut Nodes) {
        if let Some(pending) = self.question.take_if(|pending| turn.strikes(pending.deadline)) {
            self.take_answer(turn, nodes, &pending.question, Err("the job's own policy took too long".into()));
        }
    }

    fn take_answer(&mut self, turn: &mut Turn, nodes: &mut Nodes, question: &Question, answer: Result<Answer, String>) {
        let checked = answer.and_then(|answer| check(question, answer));
        match (question, checked) {
            (_, Ok(Answer::Split(rects))) => self.take_split(turn, nodes, rects),
            (Question::Redistribute { parts, .. }, Ok(Answer::Plan(plan))) => self.take_redistribution(turn, nodes, parts, &plan),
            (_, Ok(Answer::Plan(plan))) => self.begin_rendering(turn, nodes, plan),
            (Question::Redistribute { .. }, Err(reason)) => self.replace_policy(turn, nodes, &reason),
            (_, Err(reason)) => self.end(turn, nodes, Outcome::Failed { reason }),
        }
    }
}

/// Whether an answer answers the question.
fn check(question: &Question, answer: Answer) -> Result<Answer, String> {
    match (question, &answer) {
        (Question::Split { .. }, Answer::Split(_)) => Ok(answer), // its rectangles are checked when they are taken
        (Question::Assign { parts, nodes } | Question::Redistribute { parts, nodes }, Answer::Plan(plan)) => {
            assign::validate(plan, parts, nodes).map_err(|wrong| format!("assign: {wrong}"))?;
            Ok(answer)
        }
        (Question::Split { .. }, _) => Err("split: the answer is not a list of rectangles".into()),
        _ => Err("assign: the answer is not a plan".into()),
    }
}
