//! `trueline simulate --axis`.

use clap::Args;
use trueline_dataset::Carries;
use trueline_dataset::axes::is_axis_name;
use trueline_geometry::AxisKind;
use trueline_sim::{AxisCourse, Scenario, SimulatedAxis};

/// Options that do not apply to a scan with axes.
const NOT_OF_AXES: [&str; 9] =
    ["plan", "images", "plates", "production", "boards", "shop", "seam", "sightings", "faults"];

#[derive(Args)]
#[group(id = "of_axes")]
pub(crate) struct AxesArgs {
    /// Add an external axis somewhere beside the seam, and axes.csv and cell.toml; may be repeated, in the order of the chain
    #[arg(
        long = "axis",
        value_name = "NAME=KIND,CARRIES,COURSE",
        value_parser = axis,
        conflicts_with_all = NOT_OF_AXES,
        long_help = "Add an external axis somewhere beside the seam, and axes.csv and cell.toml; may be repeated, in the order of the chain. KIND is \
                     rotary or linear, CARRIES is part, robot or sensor, COURSE is `swing:BY@HZ`, `stand:V/V/V` or `run:RATE`, in degrees or mm: \
                     table=rotary,part,swing:30@0.1"
    )]
    pub(crate) axes: Vec<AxisArg>,
}

/// An axis as it is asked for.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct AxisArg {
    name: String,
    kind: AxisKind,
    carries: Carries,
    course: AxisCourse,
}

impl AxesArgs {
    /// The axes, each somewhere beside the seam of a scenario.
    #[must_use]
    pub(crate) fn somewhere(&self, scenario: &Scenario, seed: u64) -> Vec<SimulatedAxis> {
        let place = |(k, axis): (u64, &AxisArg)| {
            let (moves, course) = ((axis.kind, axis.carries), axis.course.clone());
            SimulatedAxis::somewhere(&axis.name, moves, course, scenario, seed.wrapping_add(k << 32))
        };
        (0..).zip(&self.axes).map(place).collect()
    }
}

fn axis(text: &str) -> Result<AxisArg, String> {
    const FORM: &str = "expected NAME=KIND,CARRIES,COURSE, as in table=rotary,part,swing:30@0.1";
    let (name, rest) = text.split_once('=').ok_or(FORM)?;
    let [kind, carries, course] = rest.splitn(3, ',').collect::<Vec<_>>()[..] else {
        return Err(FORM.to_owned());
    };
    let kind =
        AxisKind::named(kind).ok_or_else(|| format!("`{kind}` is not a kind of axis: rotary or linear"))?;
    let carries = Carries::named(carries)
        .ok_or_else(|| format!("`{carries}` cannot be carried by an axis: part, robot or sensor"))?;
    if !is_axis_name(name) {
        return Err(format!("`{name}` is not a name of an axis: letters, digits, - and _"));
    }
    Ok(AxisArg { name: name.to_owned(), kind, carries, course: course_of(course, kind)? })
}

fn course_of(text: &str, kind: AxisKind) -> Result<AxisCourse, String> {
    const FORMS: &str = "expected swing:BY@HZ, stand:V/V/V or run:RATE";
    let value = |text: &str| -> Result<f64, String> {
        let number: f64 = text.parse().map_err(|_| format!("`{text}` is not a number"))?;
        if !number.is_finite() {
            return Err(format!("`{text}` is not a finite number"));
        }
        Ok(if kind == AxisKind::Rotary { number.to_radians() } else { number * 1e-3 })
    };
    match text.split_once(':').ok_or(FORMS)? {
        ("swing", of) => {
            let (by, hz) = of.split_once('@').ok_or(FORMS)?;
            let hz: f64 = hz.parse().map_err(|_| format!("`{hz}` is not a number"))?;
            if !(hz > 0.0 && hz <= 5.0) {
                return Err("an axis swings with 5 Hz at most".to_owned());
            }
            Ok(AxisCourse::Swings { by: value(by)?, hz })
        }
        ("stand", places) => Ok(AxisCourse::Stands(places.split('/').map(value).collect::<Result<_, _>>()?)),
        ("run", rate) => Ok(AxisCourse::Runs(value(rate)?)),
        _ => Err(FORMS.to_owned()),
    }
}
