//! A simulated controller: its messages, and its reaction to answers if it is not set to `ONLYSEND`.
//!
//! By KUKA's manual (RSI 5.0) an answer counts if it comes within the cycle and repeats the count of the message. Late
//! answers are discarded, and after too many of them the robot stops. Assumed here: that late ones in a row are counted, and
//! that the first message counts already.

use crate::zyx_angles;
use quick_xml::Reader;
use quick_xml::events::Event;
use std::fmt;
use trueline_geometry::Pose;

/// A controller.
#[derive(Clone, Debug, Default)]
pub struct RsiController {
    awaits: Option<Awaits>,
}

/// Answers that a controller awaits, and those that came.
#[derive(Clone, Debug)]
struct Awaits {
    sentype: String,
    timeout_cycles: u32,
    /// The count that an answer must have.
    ipoc: Option<u64>,
    late_in_row: u32,
    has_ended: bool,
    counts: AnswerCounts,
}

/// Counts of the awaited answers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AnswerCounts {
    /// Of the running cycle.
    pub in_time: u64,
    /// Cycles that ended without one.
    pub missing: u64,
    /// Answers of another cycle, of another name, or no answers at all.
    pub refused: u64,
    /// Answers that would have moved the robot; none is followed.
    pub corrections: u64,
    /// RSI ended, and the robot stopped, because too many were missing.
    pub stopped: bool,
}

impl fmt::Display for AnswerCounts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { in_time, missing, refused, corrections, stopped } = self;
        write!(
            f,
            "{in_time} answers in time, {missing} missing, {refused} refused, {corrections} with corrections, which are not followed"
        )?;
        if *stopped {
            f.write_str("; too many were missing in a row: RSI ended, the robot stopped (KSS29002)")?;
        }
        Ok(())
    }
}

impl RsiController {
    /// Awaits answers of a name in each cycle, and stops when more than this many in a row are missing (`Timeout`).
    #[must_use]
    pub fn awaiting(sentype: String, timeout_cycles: u32) -> Self {
        let counts = AnswerCounts::default();
        let awaits = Awaits { sentype, timeout_cycles, ipoc: None, late_in_row: 0, has_ended: false, counts };
        Self { awaits: Some(awaits) }
    }

    /// Counts of the answers, if any are awaited.
    #[must_use]
    pub fn answers(&self) -> Option<AnswerCounts> {
        self.awaits.as_ref().map(|awaits| awaits.counts)
    }

    /// The message of a cycle: actual and set pose, the first digital input, answers missed, the cycle's count. None when RSI has ended.
    pub fn message(&mut self, base_from_tool: &Pose, ipoc: u64, input: bool) -> Option<String> {
        let delay = match &mut self.awaits {
            None => 0,
            Some(awaits) => awaits.next(ipoc)?,
        };
        Some(message(base_from_tool, ipoc, input, delay))
    }

    /// Takes an answer.
    pub fn receive(&mut self, bytes: &[u8]) {
        if let Some(awaits) = &mut self.awaits {
            awaits.receive(bytes);
        }
    }
}

impl Awaits {
    /// Ends the cycle before and begins one; returns the value of `Delay` in it.
    fn next(&mut self, ipoc: u64) -> Option<u32> {
        if self.ipoc.replace(ipoc).is_some() {
            self.late_in_row += 1;
            self.counts.missing += 1;
        }
        self.has_ended |= self.late_in_row > self.timeout_cycles;
        self.counts.stopped = self.has_ended;
        (!self.has_ended).then_some(self.late_in_row)
    }

    fn receive(&mut self, bytes: &[u8]) {
        let answer = std::str::from_utf8(bytes).ok().and_then(Answer::read);
        let Some(answer) =
            answer.filter(|answer| answer.sentype == self.sentype && Some(answer.ipoc) == self.ipoc)
        else {
            self.counts.refused += 1;
            return;
        };
        self.counts.corrections += u64::from(answer.corrects);
        self.counts.in_time += 1;
        (self.ipoc, self.late_in_row) = (None, 0);
    }
}

struct Answer {
    sentype: String,
    ipoc: u64,
    corrects: bool,
}

impl Answer {
    fn read(text: &str) -> Option<Self> {
        let mut reader = Reader::from_str(text);
        let (mut sentype, mut ipoc, mut corrects, mut in_ipoc) = (None, None, false, false);
        loop {
            match reader.read_event().ok()? {
                Event::Start(tag) | Event::Empty(tag) => {
                    in_ipoc = tag.name().as_ref() == "IPOC";
                    for attribute in tag.attributes() {
                        let attribute = attribute.ok()?;
                        match tag.name().as_ref() {
                            "Sen" => sentype = Some(attribute.value.to_string()),
                            _ => corrects |= attribute.value.parse::<f64>().ok()? != 0.0,
                        }
                    }
                }
                Event::Text(text) if in_ipoc => ipoc = Some(text.parse().ok()?),
                Event::End(_) => in_ipoc = false,
                Event::Eof => break,
                _ => {}
            }
        }
        Some(Self { sentype: sentype?, ipoc: ipoc?, corrects })
    }
}

/// A message as the controller's configuration of `trueline robot-program kuka` makes it.
#[must_use]
pub fn message(base_from_tool: &Pose, ipoc: u64, input: bool, delay: u32) -> String {
    let p = base_from_tool.translation.vector * 1e3;
    let [a, b, c] = zyx_angles::to_abc_deg(&base_from_tool.rotation);
    let pose =
        format!("X=\"{:.4}\" Y=\"{:.4}\" Z=\"{:.4}\" A=\"{a:.4}\" B=\"{b:.4}\" C=\"{c:.4}\"", p.x, p.y, p.z);
    let input = u8::from(input);
    format!(
        "<Rob Type=\"KUKA\"><RIst {pose}/><RSol {pose}/>\
         <AIPos A1=\"0.0\" A2=\"-90.0\" A3=\"90.0\" A4=\"0.0\" A5=\"90.0\" A6=\"0.0\"/>\
         <ASPos A1=\"0.0\" A2=\"-90.0\" A3=\"90.0\" A4=\"0.0\" A5=\"90.0\" A6=\"0.0\"/>\
         <Delay D=\"{delay}\"/><DiL>{input}</DiL><IPOC>{ipoc}</IPOC></Rob>"
    )
}
