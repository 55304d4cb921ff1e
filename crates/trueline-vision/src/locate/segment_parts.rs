//! Line segments in their parts: the stripes on two plates in one plane lie on one line, and are one segment until here.

use crate::locate::line_segment::{FEWEST, LineSegment, MOST_SEGMENTS, SegmentMark};

/// A stretch without an edgel that parts a segment, px: more than two tiles.
const GAP_PX: f64 = 40.0;

/// Parts of segments; keeps its memory from one picture to the next.
#[derive(Clone, Debug, Default)]
pub(crate) struct SegmentParts {
    parts: Vec<LineSegment>,
    spare: Vec<Vec<SegmentMark>>,
}

impl SegmentParts {
    /// The parts of segments, the strongest first, and no more than the allowed number of segments.
    pub(crate) fn of(&mut self, segments: &[LineSegment]) -> &[LineSegment] {
        self.spare.extend(self.parts.drain(..).map(|part| part.marks));
        for segment in segments {
            for marks in segment.marks.chunk_by(|a, b| b.s - a.s < GAP_PX) {
                if marks.len() >= FEWEST && self.parts.len() < 2 * MOST_SEGMENTS {
                    let mut own = self.spare.pop().unwrap_or_default();
                    own.clear();
                    own.extend_from_slice(marks);
                    self.parts.push(LineSegment {
                        marks: own,
                        line: segment.line,
                        sigma_px: segment.sigma_px,
                        brightness: segment.brightness,
                    });
                }
            }
        }
        self.parts.sort_unstable_by(|a, b| b.weight().total_cmp(&a.weight()));
        &self.parts[..self.parts.len().min(MOST_SEGMENTS)]
    }
}
