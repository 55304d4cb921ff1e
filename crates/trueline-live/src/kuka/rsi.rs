//! The stream of messages: cycles of 4 or 12 ms, of simulators 1, told by the IPOC alone; and answers, where the controller waits for them.
//!
//! Answers make the PC a part of the robot's motion loop, so the user must ask for them. A message is answered if it is the
//! robot's, in order, complete, and the newest. It is answered once, within its cycle, with a [`ZeroAnswer`], which cannot
//! hold any other correction. A doubtful message is not answered: the controller stops the robot itself when answers are
//! missing.

use super::input_element::InputElement;
use super::ipoc::Ipoc;
use super::rob_message::{self, Inputs, RobMessage};
use super::zero_answer::ZeroAnswer;
use crate::frame_filter::{Rejection, SequenceStatus};
use crate::robot_source::{PoseMeaning, RobotPose, RobotStatus, SourceAbout};
use crate::udp_source::DatagramProtocol;

const MS_NS: i64 = 1_000_000;
/// An answer later than the longest cycle of RSI comes after its cycle in any case, ns.
const ANSWER_WITHIN_NS: i64 = 12 * MS_NS;

/// One controller's stream.
#[derive(Clone, Debug, Default)]
pub struct Rsi {
    inputs: InputElement,
    /// The element was named, so its absence is reported.
    inputs_asked: bool,
    inputs_seen: Option<Inputs>,
    /// The least that the IPOC rose by from one message to the next, ms: the cycle.
    cycle_ms: Option<u32>,
    /// Answers that the controller missed, by its last report.
    delayed: u32,
    answers: Option<Answers>,
    arrived_ns: i64,
}

/// The answers and their results.
#[derive(Clone, Debug)]
struct Answers {
    zero: ZeroAnswer,
    /// The newest message, and when it came, ns, until it is answered.
    due: Option<(Ipoc, i64)>,
    given: u64,
    /// A newer message was there already.
    overtaken: u64,
    /// Too old when this program came to it.
    late: u64,
}

impl Rsi {
    /// Listens; with the element that holds the inputs, if it is not the usual one, and the answer that messages get, if any.
    #[must_use]
    pub fn new(inputs: Option<InputElement>, answer: Option<ZeroAnswer>) -> Self {
        let answers = answer.map(|zero| Answers { zero, due: None, given: 0, overtaken: 0, late: 0 });
        Self {
            inputs_asked: inputs.is_some(),
            inputs: inputs.unwrap_or_default(),
            answers,
            ..Self::default()
        }
    }

    fn inputs(&mut self, inputs: Inputs) -> Option<u64> {
        self.inputs_seen = Some(inputs);
        match inputs {
            Inputs::Bits(bits) => Some(bits),
            Inputs::Missing | Inputs::Odd => None,
        }
    }

    fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        match (self.inputs_seen, self.inputs_asked) {
            (Some(Inputs::Missing), true) => {
                notes.push(format!("the messages have no {}: inputs are not recorded", self.inputs));
            }
            (Some(Inputs::Odd), _) => {
                notes.push(format!("{} is not a whole number: inputs are not recorded", self.inputs));
            }
            _ => {}
        }
        match &self.answers {
            Some(answers) => notes.extend(answers.notes(self.delayed)),
            None if self.delayed > 0 => notes.push(
                "the controller counts missing answers (Delay): set ONLYSEND to TRUE, or consent to answer it, else it stops \
                 the robot"
                    .to_owned(),
            ),
            None => {}
        }
        notes
    }
}

impl Answers {
    fn notes(&self, delayed: u32) -> Vec<String> {
        let Self { given, overtaken, late, .. } = self;
        let mut notes = vec![format!(
            "this PC is part of the robot's motion loop: {given} messages answered, all with zero corrections; when it falls silent RSI \
             ends and the robot stops"
        )];
        notes.extend(self.zero.left_out());
        if overtaken + late > 0 {
            notes.push(format!(
                "{overtaken} messages were not answered because a newer one was there, {late} because they were too old"
            ));
        }
        if delayed > 0 {
            notes.push(format!("the controller counts {delayed} answers that came too late (Delay)"));
        }
        notes
    }
}

impl DatagramProtocol for Rsi {
    type Raw = RobMessage;

    fn decode(&self, bytes: &[u8]) -> Result<(u32, RobMessage), Rejection> {
        let message = rob_message::read(bytes, &self.inputs)?;
        // The IPOC may be longer than 32 bits; its lower part counts as well.
        Ok((message.ipoc.ms() as u32, message))
    }

    fn place(&mut self, raw: RobMessage, status: SequenceStatus) -> (RobotPose, SequenceStatus) {
        self.delayed = raw.delayed.unwrap_or(self.delayed);
        let is_newest = status != SequenceStatus::Late;
        let status = match status {
            SequenceStatus::Newest { skipped } => {
                let rose_ms = skipped.saturating_add(1);
                let cycle_ms = self.cycle_ms.map_or(rose_ms, |cycle_ms| cycle_ms.min(rose_ms));
                self.cycle_ms = Some(cycle_ms);
                SequenceStatus::Newest { skipped: (rose_ms / cycle_ms).saturating_sub(1) }
            }
            SequenceStatus::First => {
                self.cycle_ms = None;
                status
            }
            SequenceStatus::Late => status,
        };
        if let (Some(answers), true) = (&mut self.answers, is_newest) {
            let before = answers.due.replace((raw.ipoc, self.arrived_ns));
            answers.overtaken += u64::from(before.is_some());
        }
        let pose = RobotPose {
            sequence: raw.ipoc.ms() as u32,
            device_ns: i64::try_from(raw.ipoc.ms()).unwrap_or(i64::MAX / MS_NS).saturating_mul(MS_NS),
            base_from_tool: raw.pose,
            status: RobotStatus::Unknown,
            inputs: self.inputs(raw.inputs),
        };
        (pose, status)
    }

    fn notice(&mut self, _: &[u8], now_ns: i64) {
        self.arrived_ns = now_ns;
    }

    fn answer(&mut self, now_ns: i64) -> Option<Vec<u8>> {
        let answers = self.answers.as_mut()?;
        let (ipoc, arrived_ns) = answers.due.take()?;
        if now_ns - arrived_ns > ANSWER_WITHIN_NS {
            answers.late += 1;
            return None;
        }
        answers.given += 1;
        Some(answers.zero.to(&ipoc))
    }

    fn must_answer(&self) -> bool {
        self.answers.is_some()
    }

    fn about(&self) -> SourceAbout {
        let way =
            if self.answers.is_some() { "answering with zero corrections" } else { "listening, ONLYSEND" };
        SourceAbout {
            protocol: format!("KUKA RSI ({way})"),
            pose: PoseMeaning::TcpInActiveBase,
            clock: "IPOC: the controller's interpolation cycles, in ms",
            controller: None,
            notes: self.notes(),
        }
    }
}
