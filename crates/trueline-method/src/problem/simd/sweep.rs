//! All observations, four of a line at a time, in a fixed order.

use super::samples::{Gathering, Samples};
use super::view::{
    BowedLines, DistanceFromLines, Modelled, Mounting, Seam, Seen, ShapedSheet, StraightLines, see,
};
use crate::config::ResidualKind;
use crate::input::observations::{Observation, Observations};
use crate::parallel;
use crate::problem::parameters::Parameters;
use crate::problem::unknowns::Model;

/// A list of observations with some parameters.
#[derive(Clone, Copy)]
pub(crate) struct Scan<'a> {
    /// Trajectory and sheet.
    pub observations: &'a Observations,
    /// The observations, by rising stamp.
    pub list: &'a [Observation],
    /// The parameters.
    pub at: &'a Parameters,
    /// The residual.
    pub residual: ResidualKind,
}

/// Processes each group of four. A visitor may exclude models, for which then no sweep is compiled.
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
    fn samples<const FUSED: bool, M: Modelled>(
        &mut self,
        line: usize,
        samples: &Samples,
        seen: &Seen<FUSED, M::Rows<FUSED>>,
    );

    /// An observation outside the robot's recording, or in one of its gaps.
    fn unplaced(&mut self, index: usize);
}

/// Samples gathered at once, so that they stay in a near cache.
const GATHERED: usize = 64;

/// Gathers the samples of a scan and sweeps them.
pub(crate) fn sweep(scan: &Scan<'_>, visit: &mut impl Visit) {
    let Scan { observations, list, at, .. } = scan;
    let mut gathering = Gathering::new(observations, list, at.lines.len(), at.time_offset_s);
    loop {
        let samples = gathering.next_samples(GATHERED);
        if samples.is_empty() {
            return;
        }
        sweep_samples(scan, samples, visit);
    }
}

/// Sweeps samples of a scan with the widest instructions of the processor.
pub(crate) fn sweep_samples(scan: &Scan<'_>, samples: &[Samples], visit: &mut impl Visit) {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma") {
        // SAFETY: the function requires AVX2 and FMA, and the processor was just tested for both.
        #[expect(unsafe_code, reason = "the only way to call a function for a processor found at run time")]
        unsafe {
            sweep_avx2(scan, samples, visit);
        }
        return;
    }
    sweep_with::<false, _>(scan, samples, visit);
}

/// Observations in one chunk. Sums of chunks are added in a fixed order, independent of threads, so that the result is identical to the last bit.
pub(crate) const CHUNK: usize = 16_384;

/// Sweeps chunk by chunk on a number of threads, or from kept samples if the scan has one chunk. Returns the visitor of each chunk, in order.
pub(crate) fn sweep_chunks<V: Visit + Send>(
    scan: &Scan<'_>,
    kept: Option<&[Samples]>,
    threads: usize,
    visitor: impl Fn(std::ops::Range<usize>) -> V + Sync,
) -> Vec<V> {
    let chunks = scan.list.len().div_ceil(CHUNK).max(1);
    let range = |chunk: usize| chunk * CHUNK..scan.list.len().min((chunk + 1) * CHUNK);
    let visited = |chunk: usize| {
        let mut visit = visitor(range(chunk));
        let of_chunk = Scan { list: &scan.list[range(chunk)], ..*scan };
        match kept {
            Some(kept) => sweep_samples(&of_chunk, kept, &mut visit),
            None => sweep(&of_chunk, &mut visit),
        }
        visit
    };
    parallel::map(threads, chunks, visited)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn sweep_avx2(scan: &Scan<'_>, samples: &[Samples], visit: &mut impl Visit) {
    sweep_with::<true, _>(scan, samples, visit);
}

#[inline(always)]
fn sweep_with<const FUSED: bool, V: Visit>(scan: &Scan<'_>, samples: &[Samples], visit: &mut V) {
    match (scan.residual, scan.at.unknowns().model) {
        (ResidualKind::Sheet, Model::Straight) if V::STRAIGHT => {
            sweep_model::<FUSED, StraightLines>(scan, samples, visit);
        }
        (ResidualKind::Sheet, Model::Bowed) if V::BOWED => {
            sweep_model::<FUSED, BowedLines>(scan, samples, visit);
        }
        (ResidualKind::Sheet, Model::Shaped) if V::SHAPED => {
            sweep_model::<FUSED, ShapedSheet>(scan, samples, visit);
        }
        // The paper's residual supports a straight line and an exact sensor only.
        (ResidualKind::PointToLine, _) if V::TO_LINE => {
            sweep_model::<FUSED, DistanceFromLines>(scan, samples, visit);
        }
        (residual, model) => unreachable!("a visitor that says it never meets {residual:?} of {model:?}"),
    }
}

#[inline(always)]
fn sweep_model<const FUSED: bool, M: Modelled>(scan: &Scan<'_>, samples: &[Samples], visit: &mut impl Visit) {
    let mounting = Mounting::new(&scan.observations.sheet, scan.at);
    let seam = |line: usize| Seam {
        line: &scan.at.lines[line],
        bow: scan.at.curvatures.get(line),
        shape: scan.at.shape.as_ref(),
    };
    for mut samples in samples.iter().filter(|samples| samples.count > 0) {
        let moved;
        if !samples.hold_with(mounting.time_offset_s) {
            let unplaced;
            (moved, unplaced) = samples.moved(scan.observations, scan.list, mounting.time_offset_s);
            unplaced.indices().for_each(|index| visit.unplaced(index));
            samples = &moved;
            if samples.count == 0 {
                continue;
            }
        }
        let line = samples.line as usize;
        visit.samples::<FUSED, M>(line, samples, &see::<FUSED, M>(&mounting, &seam(line), samples));
    }
}
