//! A controller that says anything.

use super::{PERIOD_NS, frame, limits, s_path};
use trueline_geometry::Pose;
use trueline_live::motion::{CheckedPath, Gate, GateState, Input, OperatorCommand, ReceivedFrame, Reference};

/// A controller that says what it wants, when it wants.
pub(crate) struct Liar {
    pub(crate) gate: Gate,
    pub(crate) state: GateState,
    pub(crate) now_ns: i64,
    pub(crate) k: i64,
    pub(crate) sent: Vec<(i64, Reference)>,
    /// Its last stated pose.
    pub(crate) said: Pose,
}

impl Liar {
    pub(crate) fn new() -> Self {
        let gate = Gate::new(limits(), CheckedPath::new(&s_path(1.0), 1.0, &limits()).unwrap(), 0.2);
        let said = gate.path().at(0.0).base_from_tool;
        Self { gate, state: GateState::default(), now_ns: 0, k: 0, sent: Vec::new(), said }
    }

    pub(crate) fn start(&self) -> Pose {
        self.gate.path().at(0.0).base_from_tool
    }

    /// The pose of an honest robot.
    pub(crate) fn obedient(&self) -> Pose {
        self.sent.last().map_or_else(|| self.start(), |(_, sent)| sent.base_from_tool)
    }

    pub(crate) fn says(&mut self, after_ns: i64, pose: Pose, change: impl FnOnce(&mut ReceivedFrame)) {
        self.now_ns += after_ns;
        self.k += 1;
        self.said = pose;
        let mut received =
            ReceivedFrame { frame: frame(self.k, pose), arrival_ns: self.now_ns, is_first: self.k == 1 };
        change(&mut received);
        self.step(Some(received), OperatorCommand::Go);
    }

    pub(crate) fn step(&mut self, received: Option<ReceivedFrame>, command: OperatorCommand) {
        let input = Input { received, now_ns: self.now_ns, command };
        let (state, sent) = self.gate.step(self.state, &input);
        self.state = state;
        self.sent.extend(sent.map(|sent| (self.now_ns, sent)));
    }

    /// Obeys for so many frames.
    pub(crate) fn obeys(&mut self, frames: usize) {
        for _ in 0..frames {
            self.says(PERIOD_NS, self.obedient(), |_| {});
        }
    }
}

/// A pose so far along y.
pub(crate) fn shifted(pose: &Pose, metres: f64) -> Pose {
    let mut pose = *pose;
    pose.translation.vector.y += metres;
    pose
}
