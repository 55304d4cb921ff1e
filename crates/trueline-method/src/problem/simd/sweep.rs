//! All observations, four of a line at a time, in a fixed order.

use super::lanes::WIDTH;
use super::located::{InSheet, Residual, ToLine};
use super::view::{BowedLines, Modelled, Mounting, Samples, Seam, Seen, ShapedSheet, StraightLines, see};
use crate::config::ResidualKind;
use crate::input::observations::{Observation, Observations};
use crate::problem::parameters::Parameters;
use crate::problem::unknowns::Model;
use trueline_geometry::Segment;

/// What is swept: a list of observations, seen with some parameters.
#[derive(Clone, Copy)]
pub(crate) struct Scan<'a> {
    /// Trajectory and sheet.
    pub observations: &'a Observations,
    /// The observations, by rising stamp.
    pub list: &'a [Observation],
    /// The parameters.
    pub at: &'a Parameters,
    /// Which residual.
    pub residual: ResidualKind,
}

/// What is done with each four. A visitor that never meets a model says so, and no sweep is generated for the pair.
pub(crate) trait Visit {
    /// Whether it meets straight lines and an exact sensor in the sheet.
    const STRAIGHT: bool = true;
    /// Whether it meets bowed lines.
    const BOWED: bool = true;
    /// Whether it meets a sensor with a shape.
    const SHAPED: bool = true;
    /// Whether it meets the distance from the line in base.
    const TO_LINE: bool = true;

    /// Up to four samples of one line.
    fn samples<const FUSED: bool>(&mut self, line: usize, samples: &Samples, seen: &Seen<FUSED>);

    /// An observation outside the robot's recording, or in one of its gaps.
    fn unplaced(&mut self, index: usize);
}

/// Sweeps with the widest instructions that the processor has.
pub(crate) fn sweep(scan: &Scan<'_>, visit: &mut impl Visit) {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma") {
        // SAFETY: the function asks for AVX2 and FMA, and the processor has just said that it has both.
        #[expect(unsafe_code, reason = "the only way to call a function for a processor found at run time")]
        unsafe {
            sweep_avx2(scan, visit);
        }
        return;
    }
    sweep_with::<false, _>(scan, visit);
}

/// Observations that are swept in one go: their sums are added to those of the next in this order, whoever computes
/// them, so that the result is the same to the last bit.
const CHUNK: usize = 16_384;

/// Sweeps chunk by chunk, on so many threads; what each chunk's visitor has seen, in order.
pub(crate) fn sweep_chunks<V: Visit + Send>(
    scan: &Scan<'_>,
    threads: usize,
    visitor: impl Fn(std::ops::Range<usize>) -> V + Sync,
) -> Vec<V> {
    let chunks = scan.list.len().div_ceil(CHUNK).max(1);
    let range = |chunk: usize| chunk * CHUNK..scan.list.len().min((chunk + 1) * CHUNK);
    let visited = |chunk: usize| {
        let mut visit = visitor(range(chunk));
        sweep(&Scan { list: &scan.list[range(chunk)], ..*scan }, &mut visit);
        visit
    };
    if threads <= 1 || chunks == 1 {
        return (0..chunks).map(visited).collect();
    }
    let next = std::sync::atomic::AtomicUsize::new(0);
    let mut all: Vec<(usize, V)> = std::thread::scope(|scope| {
        let worker = || {
            let mut own = Vec::new();
            loop {
                let chunk = next.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
                if chunk >= chunks {
                    return own;
                }
                own.push((chunk, visited(chunk)));
            }
        };
        let workers: Vec<_> = (0..threads.min(chunks)).map(|_| scope.spawn(worker)).collect();
        // A worker that panicked panics here: nothing is lost silently.
        workers
            .into_iter()
            .flat_map(|worker| worker.join().unwrap_or_else(|e| std::panic::resume_unwind(e)))
            .collect()
    });
    all.sort_by_key(|(chunk, _)| *chunk);
    all.into_iter().map(|(_, visit)| visit).collect()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn sweep_avx2(scan: &Scan<'_>, visit: &mut impl Visit) {
    sweep_with::<true, _>(scan, visit);
}

#[inline(always)]
fn sweep_with<const FUSED: bool, V: Visit>(scan: &Scan<'_>, visit: &mut V) {
    match (scan.residual, scan.at.unknowns().model) {
        (ResidualKind::Sheet, Model::Straight) if V::STRAIGHT => {
            sweep_residual::<FUSED, InSheet, StraightLines>(scan, visit);
        }
        (ResidualKind::Sheet, Model::Bowed) if V::BOWED => {
            sweep_residual::<FUSED, InSheet, BowedLines>(scan, visit);
        }
        (ResidualKind::Sheet, Model::Shaped) if V::SHAPED => {
            sweep_residual::<FUSED, InSheet, ShapedSheet>(scan, visit);
        }
        // The paper's residual is the paper's: a straight line, an exact sensor.
        (ResidualKind::PointToLine, _) if V::TO_LINE => {
            sweep_residual::<FUSED, ToLine, StraightLines>(scan, visit);
        }
        (residual, model) => unreachable!("a visitor that says it never meets {residual:?} of {model:?}"),
    }
}

#[inline(always)]
fn sweep_residual<const FUSED: bool, R: Residual, M: Modelled>(scan: &Scan<'_>, visit: &mut impl Visit) {
    let mounting = Mounting::new(&scan.observations.sheet, scan.at);
    let trajectory = &scan.observations.robot.trajectory;
    // Each line gathers its own four: their sums go to the same unknowns.
    let mut waiting = vec![Waiting::default(); scan.at.lines.len()];
    let mut cursor = trajectory.cursor();
    let seam = |line: usize| Seam {
        line: &scan.at.lines[line],
        bow: scan.at.curvatures.get(line),
        shape: scan.at.shape.as_ref(),
    };
    for (index, o) in scan.list.iter().enumerate() {
        let Some(segment) = cursor
            .bracket(o.stamp_s - scan.at.time_offset_s)
            .filter(|found| trajectory.segment(*found).is_some())
        else {
            visit.unplaced(index);
            continue;
        };
        let line = o.line as usize;
        let waiting = &mut waiting[line];
        waiting.index[waiting.count] = index as u32;
        waiting.segment[waiting.count] = segment as u32;
        waiting.count += 1;
        if waiting.count == WIDTH {
            let samples = waiting.gather(scan);
            visit.samples(line, &samples, &see::<FUSED, R, M>(&mounting, &seam(line), &samples));
            waiting.count = 0;
        }
    }
    for (line, waiting) in waiting.iter_mut().enumerate().filter(|(_, waiting)| waiting.count > 0) {
        // Lanes without a sample repeat the first, so that they hold numbers.
        for lane in waiting.count..WIDTH {
            (waiting.index[lane], waiting.segment[lane]) = (waiting.index[0], waiting.segment[0]);
        }
        let samples = waiting.gather(scan);
        visit.samples(line, &samples, &see::<FUSED, R, M>(&mounting, &seam(line), &samples));
    }
}

/// Observations of one line that wait for a fourth.
#[derive(Clone, Copy, Default)]
struct Waiting {
    index: [u32; WIDTH],
    segment: [u32; WIDTH],
    count: usize,
}

impl Waiting {
    #[inline(always)]
    fn gather(&self, scan: &Scan<'_>) -> Samples {
        let segments = scan.observations.robot.trajectory.segments();
        let s = [
            &segments[self.segment[0] as usize],
            &segments[self.segment[1] as usize],
            &segments[self.segment[2] as usize],
            &segments[self.segment[3] as usize],
        ];
        let o = [
            &scan.list[self.index[0] as usize],
            &scan.list[self.index[1] as usize],
            &scan.list[self.index[2] as usize],
            &scan.list[self.index[3] as usize],
        ];
        let offset = scan.at.time_offset_s;
        // Written out, so that every component is loaded into its lane and none goes through memory.
        macro_rules! lanes {
            ($from:ident, $field:expr) => {{
                let field = $field;
                [field($from[0]), field($from[1]), field($from[2]), field($from[3])]
            }};
        }
        macro_rules! vectors {
            ($from:ident, $type:ty, $($field:ident).+) => {
                [
                    lanes!($from, |x: &$type| x.$($field).+.x),
                    lanes!($from, |x: &$type| x.$($field).+.y),
                    lanes!($from, |x: &$type| x.$($field).+.z),
                ]
            };
        }
        Samples {
            index: self.index,
            count: self.count,
            elapsed: [
                o[0].stamp_s - offset - s[0].start,
                o[1].stamp_s - offset - s[1].start,
                o[2].stamp_s - offset - s[2].start,
                o[3].stamp_s - offset - s[3].start,
            ],
            rotation: [
                lanes!(s, |s: &Segment| s.base_from_tool.rotation.w),
                lanes!(s, |s: &Segment| s.base_from_tool.rotation.i),
                lanes!(s, |s: &Segment| s.base_from_tool.rotation.j),
                lanes!(s, |s: &Segment| s.base_from_tool.rotation.k),
            ],
            position: vectors!(s, Segment, base_from_tool.translation.vector),
            rate: vectors!(s, Segment, body_rate),
            velocity: vectors!(s, Segment, velocity),
            point: vectors!(o, Observation, point_in_camera),
        }
    }
}
