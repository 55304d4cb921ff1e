//! The loop that guides the robot: receives frames, asks the gate, answers the newest frame.
//!
//! Nothing in it waits for anybody but the robot. Observers (recorder, display) are called with all received and sent
//! messages. If they panic, the scan still stops smoothly.

use crate::egm::{Axes, EgmFeedBack, EgmHeader, EgmPose, EgmSensor, EgmSpeedRef, Message, MessageType};
use crate::endpoint::{Endpoint, Newest, Received};
use crate::motion::{EndReason, Gate, GateState, Input, OperatorCommand, Phase, ReceivedFrame, Reference};
use std::io;
use std::net::SocketAddr;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::thread;
use std::time::{Duration, Instant};

/// Looks on.
pub trait Observer {
    /// A datagram came.
    fn received(&mut self, received: &Received<'_>);

    /// An answer was sent, at a steady time, ns.
    fn answered(&mut self, answer: &Answer);

    /// A step is done.
    fn stepped(&mut self, state: &GateState);
}

/// An answer that was sent.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// Its bytes.
    pub bytes: Vec<u8>,
    /// To whom.
    pub to: SocketAddr,
    /// When, on the steady clock, ns.
    pub steady_ns: i64,
    /// Time from the kernel's stamp of the frame to after sending, ns; `None` for a last word to a silent robot.
    pub since_frame_ns: Option<i64>,
    /// Its own number.
    pub sequence: u32,
    /// Its content.
    pub reference: Reference,
}

/// How a scan went.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// Why it ended.
    pub end_reason: EndReason,
    /// Holds of the motion because this program was late.
    pub pauses: u32,
    /// Frames that were not believed.
    pub jumps: u32,
    /// Answers that could not be sent.
    pub unsent: u64,
    /// Somebody who looked on panicked.
    pub observer_panicked: bool,
    /// The controller's last report was that the robot was near its reference.
    pub was_converged: bool,
}

/// Guides a robot.
pub struct Guide {
    endpoint: Endpoint,
    gate: Gate,
    state: GateState,
    patience: Patience,
    began: Instant,
    sequence: u32,
    unsent: u64,
    panicked: bool,
}

/// How long a guide waits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Patience {
    /// For the controller to let itself be guided; then nothing is led any more.
    pub armed: Duration,
    /// At rest at the end, so that `EGMRunPose` can end in peace.
    pub hold: Duration,
}

/// Looks after the watchdogs when nothing comes.
const TICK: Duration = Duration::from_millis(4);
/// Times the final command is repeated, in case a datagram is lost.
const LAST_WORDS: u32 = 3;

impl Guide {
    /// Will guide the robot that the endpoint receives along the path of the gate, then hold.
    #[must_use]
    pub fn new(endpoint: Endpoint, gate: Gate, patience: Patience) -> Self {
        Self {
            endpoint,
            gate,
            state: GateState::default(),
            patience,
            began: Instant::now(),
            sequence: 0,
            unsent: 0,
            panicked: false,
        }
    }

    /// Runs until the scan is over, however it ends. `command` is asked before every step.
    ///
    /// # Errors
    /// The socket cannot be read any more; the robot was commanded to rest.
    pub fn run(
        &mut self,
        mut command: impl FnMut() -> OperatorCommand,
        observer: &mut impl Observer,
    ) -> io::Result<Outcome> {
        self.began = Instant::now();
        loop {
            let commanded = if self.panicked { command().max(OperatorCommand::Stop) } else { command() };
            let step = catch_unwind(AssertUnwindSafe(|| self.step(commanded, observer)));
            let step = step.unwrap_or_else(|_| Err(io::Error::other("a step of the guidance panicked")));
            let ended = match step {
                Ok(None) => continue,
                Ok(Some(end_reason)) => Ok(end_reason),
                Err(error) => Err(error),
            };
            self.say_last_words(observer);
            return ended.map(|end_reason| Outcome {
                end_reason,
                pauses: self.state.pauses,
                jumps: self.state.jumps,
                unsent: self.unsent,
                observer_panicked: self.panicked,
                was_converged: self.state.was_converged(),
            });
        }
    }

    fn step(
        &mut self,
        command: OperatorCommand,
        observer: &mut impl Observer,
    ) -> io::Result<Option<EndReason>> {
        let panicked = &mut self.panicked;
        let newest =
            self.endpoint.receive(TICK, |received| watched(panicked, || observer.received(received)))?;
        let now_ns = self.endpoint.clock().read().steady_ns;
        let received = newest.map(|Newest { frame, is_first, arrival, .. }| ReceivedFrame {
            frame,
            arrival_ns: arrival.steady_ns,
            is_first,
        });
        let (state, reference) = self.gate.step(self.state, &Input { received, now_ns, command });
        self.state = state;
        if let Some(reference) = reference {
            self.say(&reference, received.map(|received| received.arrival_ns), observer);
        }
        let state = self.state;
        watched(&mut self.panicked, || observer.stepped(&state));
        Ok(self.ended(now_ns, command, received.is_some()))
    }

    fn say(&mut self, reference: &Reference, frame_ns: Option<i64>, observer: &mut impl Observer) {
        let Some(robot) = self.endpoint.frame_filter().robot() else { return };
        if let Some(answer) = self.answer(robot, reference, frame_ns) {
            watched(&mut self.panicked, || observer.answered(&answer));
        }
    }

    /// In any case: if the last message was a movement, the robot is commanded to rest, and again.
    fn say_last_words(&mut self, observer: &mut impl Observer) {
        let Some(last) = self.state.last_sent() else { return };
        for _ in 0..LAST_WORDS {
            self.say(&Reference::rest(last.base_from_tool), None, observer);
            thread::sleep(TICK);
        }
    }

    fn answer(&mut self, to: SocketAddr, reference: &Reference, frame_ns: Option<i64>) -> Option<Answer> {
        self.sequence = self.sequence.wrapping_add(1);
        let clock = self.endpoint.clock();
        let message = message(self.sequence, clock.read().steady_ns, reference);
        let bytes = message.encode_to_vec();
        if self.endpoint.send(to, &bytes).is_err() {
            self.unsent += 1;
            return None;
        }
        let steady_ns = clock.read().steady_ns;
        let since_frame_ns = frame_ns.map(|frame_ns| steady_ns - frame_ns);
        Some(Answer { bytes, to, steady_ns, since_frame_ns, sequence: self.sequence, reference: *reference })
    }

    fn ended(&self, now_ns: i64, command: OperatorCommand, received: bool) -> Option<EndReason> {
        match self.state.phase {
            Phase::Silent { why } => Some(why),
            Phase::Holding { since_ns, why, .. } => {
                let held_ns = u128::try_from(now_ns - since_ns).unwrap_or(0);
                (held_ns >= self.patience.hold.as_nanos()).then_some(why)
            }
            Phase::Waiting if command != OperatorCommand::Go && !received => Some(EndReason::Stopped),
            Phase::Waiting if self.began.elapsed() > self.patience.armed => Some(EndReason::NeverBegan),
            Phase::Waiting
            | Phase::Travelling { .. }
            | Phase::Interrupted { .. }
            | Phase::Stopping { .. } => None,
        }
    }
}

fn watched(panicked: &mut bool, call: impl FnOnce()) {
    *panicked |= catch_unwind(AssertUnwindSafe(call)).is_err();
}

/// A reference as EGM requires it: mm, mm/s and degrees/s in base. The attitude is a quaternion only, because Euler angles
/// would override it.
#[must_use]
pub fn message(sequence: u32, steady_ns: i64, reference: &Reference) -> EgmSensor {
    let v = reference.velocity_m_s * 1e3;
    let w = reference.angular_velocity_rad_s.map(f64::to_degrees);
    EgmSensor {
        // A counter of ms that wraps, as the controller's does.
        header: Some(EgmHeader::new(sequence, (steady_ns / 1_000_000) as u32, MessageType::Correction)),
        planned: Some(EgmFeedBack {
            cartesian: Some(EgmPose::with_quaternion(&reference.base_from_tool)),
            ..EgmFeedBack::default()
        }),
        speed_ref: Some(EgmSpeedRef {
            cartesians: Some(Axes::from([v.x, v.y, v.z, w.x, w.y, w.z])),
            ..EgmSpeedRef::default()
        }),
    }
}
