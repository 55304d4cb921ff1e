//! Searches the best optimum and its rivals.

use crate::config::Config;
use crate::error::Error;
use crate::hypotheses::ambiguity::{Ambiguity, settle};
use crate::hypotheses::likelihood_ratio::LIKELIHOOD_RATIO_LIMIT;
use crate::hypotheses::mirror::{MirrorComparison, mirror_of};
use crate::hypotheses::rivals::{self, Rival};
use crate::input::observations::Observations;
use crate::problem::parameters::{Parameters, TIME_OFFSET};
use crate::solve::fit::Fit;
use crate::solve::narrowing::thin;
use crate::solve::settings::FitSettings;
use crate::solve::solver::Solver;
use crate::solve::start::{self, Breadth};
use trueline_dataset::Guess;

/// The optimum with its rivals.
pub struct Found {
    /// The optimum.
    pub fit: Fit,
    /// Whether a mirrored attitude fits as well.
    pub mirrored: Mirrored,
    /// Rival solutions, and the decision between them.
    pub ambiguity: Ambiguity,
    /// A better optimum than that from the guess.
    pub better: Option<BetterMinimum>,
}

/// A better optimum than the one that a guess led to.
#[derive(Clone, Debug, PartialEq)]
pub struct BetterMinimum {
    /// The unknowns there.
    pub parameters: Parameters,
    /// Its noise factor: residuals divided by the expected noise.
    pub noise_factor: f64,
}

impl BetterMinimum {
    fn of(fit: &Fit) -> Self {
        Self { parameters: fit.parameters().clone(), noise_factor: fit.noise.factor }
    }
}

/// Comparison of the mirrored attitude with the one found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mirrored {
    /// The scan, or a guess, separates them.
    ToldApart,
    /// They are separable if the sensor agrees with its file.
    ToldApartBySensor,
    /// They cannot be separated.
    Equal,
}

/// A noise factor above this, or a fraction of unplaced features above [`DOUBTFUL_UNPLACED`], makes a solution doubtful. The search is then widened.
const DOUBTFUL_FACTOR: f64 = 1.2;
/// See [`DOUBTFUL_FACTOR`].
const DOUBTFUL_UNPLACED: f64 = 0.1;
/// The wide search covers all time offsets at which this fraction of the images is within the robot's recording.
const OVERLAP: f64 = 0.5;
/// A guess selects one of two mirrored attitudes if its distance to it is below this fraction of that to the other.
const CLEARLY_NEARER: f64 = 0.5;

/// Observations of each line for the search in a long scan: half a minute at 50 Hz, then twice as many …
const SEARCHED: [usize; 2] = [1_500, 3_000];
/// … and with a guess, which leaves less to search, only the larger number.
const SEARCHED_FROM_GUESS: [usize; 1] = [3_000];

/// Finds the optimum from a guess, or from the data alone.
///
/// A scan with more than twice these observations is thinned for the search, and then fitted in full. All observations are searched only if the
/// thinned ones leave a question open.
///
/// # Errors
/// [`Error::NoStart`] if there is no start.
pub fn find(solver: &Solver<'_>, guess: Option<&Guess>) -> Result<Found, Error> {
    let _stage = tracing::debug_span!("search", from_guess = guess.is_some()).entered();
    let all = solver.observations;
    let sizes = if guess.is_some() { &SEARCHED_FROM_GUESS[..] } else { &SEARCHED[..] };
    for &searched in sizes {
        if all.list.len() <= 2 * searched * all.line_count {
            break;
        }
        let some = Observations { list: thin(all, searched), ..all.without_list() };
        if let Ok(found) = find_among_all(&solver.on(&some), guess)
            && found.is_clear()
        {
            return Ok(Found { fit: solver.refit(&found.fit)?, ..found });
        }
    }
    find_among_all(solver, guess)
}

impl Found {
    /// Whether nothing else explains the scan.
    fn is_clear(&self) -> bool {
        self.mirrored == Mirrored::ToldApart
            && self.better.is_none()
            && self.ambiguity.rivals.is_empty()
            && !self.ambiguity.contradicted
    }
}

fn find_among_all(solver: &Solver<'_>, guess: Option<&Guess>) -> Result<Found, Error> {
    match guess {
        Some(guess) => from_guess(solver, guess),
        None => from_nothing(solver),
    }
}

/// A guess is not overruled. A much better optimum elsewhere is a reason to refuse the result.
fn from_guess(solver: &Solver<'_>, guess: &Guess) -> Result<Found, Error> {
    let fit = solver.fit(start::from_guess(solver.observations, guess)?)?;
    let from_guess =
        |at: &Parameters| at.tool_from_camera.rotation.angle_to(&guess.tool_from_camera.rotation);
    let (mut better, mut mirrored, mut mirror, mut chooses) = (None, Mirrored::ToldApart, None, true);
    match mirror_of(solver, &fit)? {
        MirrorComparison::Worse => {}
        MirrorComparison::WorseIfSensorIsExact(at) => {
            (mirrored, mirror) = (Mirrored::ToldApartBySensor, Some(*at));
        }
        MirrorComparison::Equal(at) => {
            mirrored = Mirrored::Equal;
            chooses = from_guess(fit.parameters()) <= CLEARLY_NEARER * from_guess(at.parameters());
            mirror = Some(*at);
        }
        MirrorComparison::Better(mirror) => better = Some(BetterMinimum::of(&mirror)),
    }
    let rivals = rivals::find(solver, &fit, mirror.as_ref().map(Fit::parameters));
    // With held quantities a search without a guess would find another solution.
    if better.is_none() && solver.settings.fixed.is_empty() && is_doubtful(solver.observations, &fit) {
        let other = search(solver, Breadth::WIDE)?.fit;
        better = is_better(solver, &other, &fit).then(|| BetterMinimum::of(&other));
    }
    let best = OfTwo { fit, mirrored, mirror };
    Ok(Found { better, ..settled(solver, best, rivals, chooses) })
}

/// The better of two mirrored attitudes, without a guess and without a search for rivals.
///
/// # Errors
/// Those of [`find`].
pub(crate) fn likeliest(solver: &Solver<'_>) -> Result<Fit, Error> {
    search(solver, Breadth::USUAL).map(|best| best.fit)
}

/// An optimum for a nearly known time offset, from few starts.
///
/// # Errors
/// Those of [`find`].
pub(crate) fn glance(solver: &Solver<'_>) -> Result<Fit, Error> {
    let Solver { observations, settings } = solver;
    solver.fit(start::from_nothing(observations, settings.config, &settings.noise, Breadth::GLANCE)?)
}

fn from_nothing(solver: &Solver<'_>) -> Result<Found, Error> {
    // Stops are few, so trying many starts is fast. With few readings many wrong attitudes leave small residuals.
    let breadth = if solver.settings.config.at_stops { Breadth::STOPS } else { Breadth::USUAL };
    let mut best = search(solver, breadth)?;
    let mut rivals = best.rivals(solver);
    if let Some(better) = rivals.iter().position(|rival| rival.is_named() && rival.test.reversed()) {
        best = with_mirror(solver, rivals.swap_remove(better).fit)?;
        rivals = best.rivals(solver);
    }
    if is_doubtful(solver.observations, &best.fit) {
        let settings = solver.settings;
        let is_held = settings.fixed.contains(&TIME_OFFSET);
        let widest_s = if is_held { 0.0 } else { widest_offset_s(solver.observations) };
        let offset_search_s = widest_s.max(settings.config.offset_search_s);
        let config = Config { offset_search_s, ..settings.config.clone() };
        let wider = Solver { settings: FitSettings { config: &config, ..settings }, ..*solver };
        let wide = search(&wider, Breadth::WIDE)?;
        if is_better(solver, &wide.fit, &best.fit) {
            best = wide;
            rivals = best.rivals(solver);
        }
    }
    Ok(settled(solver, best, rivals, false))
}

/// Chooses between a solution, its rivals and its mirror image. A guess may select the solution that it led to.
fn settled(solver: &Solver<'_>, best: OfTwo, rivals: Vec<Rival>, guess_chooses: bool) -> Found {
    let equal = best.mirror.filter(|_| best.mirrored == Mirrored::Equal);
    let (fit, ambiguity) = settle(solver, best.fit, rivals, equal, guess_chooses);
    let mirrored = match best.mirrored {
        Mirrored::Equal if ambiguity.decided_by.is_some() => Mirrored::ToldApart,
        as_found => as_found,
    };
    Found { fit, mirrored, ambiguity, better: None }
}

/// The better of two mirrored attitudes.
struct OfTwo {
    fit: Fit,
    mirrored: Mirrored,
    /// The other one, if the scan alone cannot separate them.
    mirror: Option<Fit>,
}

impl OfTwo {
    fn rivals(&self, solver: &Solver<'_>) -> Vec<Rival> {
        rivals::find(solver, &self.fit, self.mirror.as_ref().map(Fit::parameters))
    }
}

/// The better of two mirrored attitudes, without a guess.
fn search(solver: &Solver<'_>, breadth: Breadth) -> Result<OfTwo, Error> {
    let Solver { observations, settings } = solver;
    with_mirror(
        solver,
        solver.fit(start::from_nothing(observations, settings.config, &settings.noise, breadth)?)?,
    )
}

fn with_mirror(solver: &Solver<'_>, fit: Fit) -> Result<OfTwo, Error> {
    Ok(match mirror_of(solver, &fit)? {
        MirrorComparison::Worse => OfTwo { fit, mirrored: Mirrored::ToldApart, mirror: None },
        MirrorComparison::WorseIfSensorIsExact(mirror) => {
            OfTwo { fit, mirrored: Mirrored::ToldApartBySensor, mirror: Some(*mirror) }
        }
        MirrorComparison::Equal(mirror) => OfTwo { fit, mirrored: Mirrored::Equal, mirror: Some(*mirror) },
        MirrorComparison::Better(mirror) => {
            OfTwo { fit: *mirror, mirrored: Mirrored::ToldApart, mirror: None }
        }
    })
}

/// The largest time offset, of either sign, that leaves half of the images within the robot's recording.
fn widest_offset_s(observations: &Observations) -> f64 {
    let (robot_start, robot_end) = observations.robot.trajectory.span();
    let stamps = || observations.list.iter().map(|o| o.stamp_s);
    let (start, end) = (stamps().fold(f64::INFINITY, f64::min), stamps().fold(f64::NEG_INFINITY, f64::max));
    let kept = OVERLAP * (end - start).min(robot_end - robot_start);
    // With images that late, or that early.
    (end - kept - robot_start).abs().max((robot_end - start - kept).abs())
}

fn is_doubtful(observations: &Observations, fit: &Fit) -> bool {
    let all = observations.list.len() as f64;
    fit.noise.factor > DOUBTFUL_FACTOR || fit.placed.len() as f64 <= (1.0 - DOUBTFUL_UNPLACED) * all
}

fn is_better(solver: &Solver<'_>, one: &Fit, other: &Fit) -> bool {
    let [one, other] = [one, other].map(|fit| solver.twice_negative_log_likelihood(fit.parameters()));
    one + LIKELIHOOD_RATIO_LIMIT < other
}
