//! Anchor and direction of the lines.

use crate::input::observations::Observations;
use crate::order_statistics::median;
use crate::problem::parameters::Parameters;
use crate::problem::placement::placement;

/// The same parameters with each line anchored at the middle of its points and directed along the scan's motion.
///
/// Medians make wild points harmless. A scan without progress keeps its direction.
#[must_use]
pub(crate) fn with_lines_amid_points(observations: &Observations, mut at: Parameters) -> Parameters {
    let mut progress: Vec<Vec<(f64, f64)>> = vec![Vec::new(); observations.line_count];
    for o in &observations.list {
        if let Some(placement) = placement(observations, o, &at) {
            let line = &at.lines[o.line as usize];
            let from_anchor = placement.point_in_base(&o.point_in_camera) - line.anchor();
            progress[o.line as usize].push((o.stamp_s, line.direction().dot(&from_anchor)));
        }
    }
    for (line, progress) in at.lines.iter_mut().zip(progress) {
        let median_time_s = median(progress.iter().map(|p| p.0));
        let median_along_m = median(progress.iter().map(|p| p.1));
        let (Some(time_s), Some(along_m)) = (median_time_s, median_along_m) else {
            continue;
        };
        let amid = line.anchor() + line.direction() * along_m;
        let votes: f64 = progress.iter().map(|p| ((p.0 - time_s) * (p.1 - along_m)).signum()).sum();
        *line = line.anchored_near(&amid);
        if votes < 0.0 {
            *line = line.reversed();
        }
    }
    at
}
