//! Monte Carlo studies: simulated cells by the hundred, calibrated and compared with their truth.
//!
//! `cargo run --release -p trueline-studies -- NAME [ARGUMENTS]`; without a name, or with `--help`, the studies are listed.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "studies print their tables")]

mod arguments;
mod axis_cells;
mod curve_cells;
mod false_alarms;
mod healthy;
mod methods;
mod monte_carlo;
mod planned_axes;
mod real_cells;
mod rendered_boards;
mod round_cells;
mod scaling;
mod seam_bounds;
mod shop_cells;
mod sightings;
mod stripes;
mod two_sensors;
mod violations;
mod watch_table;
mod weaves;
mod weld_bounds;
mod wrong_cells;

use std::process::ExitCode;

/// A study: its name and arguments on the command line, and its subject.
struct Study {
    name: &'static str,
    arguments: &'static str,
    about: &'static str,
    /// Runs it with the arguments after its name; an error is a sentence about one of them.
    run: fn(&[String]) -> Result<(), String>,
}

const STUDIES: [Study; 21] = [
    Study {
        name: "axis_cells",
        arguments: "[CELLS A COURSE] [FIRST SEED] [--cells]",
        about: "Scans in cells with an external axis: accepted, right; are the ± honest?",
        run: axis_cells::run,
    },
    Study {
        name: "curve_cells",
        arguments: "[CELLS A KIND] [KIND] [FIRST SEED] [--cells]",
        about: "Scans over curved seams: accepted, right, silently wrong; are the ± honest?",
        run: curve_cells::run,
    },
    Study {
        name: "false_alarms",
        arguments: "[DRAWS]",
        about: "Probability of an alarm of `watch` where nothing changed, by importance sampling",
        run: false_alarms::run,
    },
    Study {
        name: "healthy",
        arguments: "[RECORDINGS PER PRESET]",
        about: "Does `doctor` find mistakes in recordings that have none?",
        run: healthy::run,
    },
    Study {
        name: "methods",
        arguments: "",
        about: "Pixel error of five methods that find the middle of a stripe, and its bound",
        run: methods::run,
    },
    Study {
        name: "monte_carlo",
        arguments: "[RUNS [PRESET …]] [--from-truth]",
        about: "Are the ± honest? NEES, coverage and Cramér–Rao bound for each preset",
        run: monte_carlo::run,
    },
    Study {
        name: "planned_axes",
        arguments: "[SCANS [WORDS OF A ROW [FIRST SEED]]]",
        about: "Scans as planned with an external axis: is what the plan promised stated, and true?",
        run: planned_axes::run,
    },
    Study {
        name: "real_cells",
        arguments: "[CELLS] [nees|seam|arm|passes|streams]",
        about: "Sensors that differ from their file, arms that are not exact, wavy seams, fast cameras",
        run: real_cells::run,
    },
    Study {
        name: "rendered_boards",
        arguments: "[SETS] [camera|plane]",
        about: "Camera and laser plane from rendered chessboards: are the ± honest?",
        run: rendered_boards::run,
    },
    Study {
        name: "round_cells",
        arguments: "[CELLS [CASE [FIRST SEED]]]",
        about: "Calibration from a sphere or a cylinder: are the ± honest?",
        run: round_cells::run,
    },
    Study {
        name: "scaling",
        arguments: "[LARGEST]",
        about: "Time and memory of a solve over scans of 10³ to 10⁷ features",
        run: scaling::run,
    },
    Study {
        name: "seam_bounds",
        arguments: "[strips|fleet]",
        about: "Bounds over curved seams: plates beside them, and parts of a production",
        run: seam_bounds::run,
    },
    Study {
        name: "shop_cells",
        arguments: "[CELLS A LEVEL] [LEVEL] [FIRST SEED] [--cells] [--stated] [--strict] [--plates]",
        about: "Whole cells with all errors of a shop: are they accepted, and are the stated errors true?",
        run: shop_cells::run,
    },
    Study {
        name: "sightings",
        arguments: "[CELLS [CASE [FIRST SEED]]]",
        about: "Calibration from pose sightings: are the ± honest?",
        run: sightings::run,
    },
    Study {
        name: "stripes",
        arguments: "[CELLS [FILTER | table]]",
        about: "Whole stripes against seam points: stated and true errors, coverage, bound, bent plates",
        run: stripes::run,
    },
    Study {
        name: "two_sensors",
        arguments: "[CELLS [FIRST SEED]]",
        about: "The transform between two sensors of a robot that errs slowly, together and each by itself",
        run: two_sensors::run,
    },
    Study {
        name: "violations",
        arguments: "[SCANS PER ROW] [WORDS OF A ROW]",
        about: "Each violation of the model: right within its ±, warned of, or refused?",
        run: violations::run,
    },
    Study {
        name: "watch_table",
        arguments: "[RUNS [PIECES [LAYOUT [CHANGE]]]]",
        about: "Pieces until `watch` finds a change, and how often it is named rightly",
        run: watch_table::run,
    },
    Study {
        name: "weaves",
        arguments: "[SCANS PER FAMILY]",
        about: "Paths that repeat themselves: right, refused, or accepted and wrong",
        run: weaves::run,
    },
    Study {
        name: "weld_bounds",
        arguments: "",
        about: "Cramér–Rao bound of what one welded piece shows, and the quickest possible alarm",
        run: weld_bounds::run,
    },
    Study {
        name: "wrong_cells",
        arguments: "[CELLS] [DURATION_S] [TRIES] [SEED]",
        about: "Planned scans in cells that differ from the guess: is the predicted spread achieved?",
        run: wrong_cells::run,
    },
];

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let Some((name, arguments)) = words.split_first().filter(|(name, _)| !is_help(name)) else {
        list();
        return ExitCode::SUCCESS;
    };
    let Some(study) = STUDIES.iter().find(|study| study.name == name) else {
        eprintln!("error: no study is named `{name}`; without a name they are listed");
        return ExitCode::from(2);
    };
    if arguments.iter().any(|word| is_help(word)) {
        println!("{}\n\nUsage: {} {}", study.about, study.name, study.arguments);
        return ExitCode::SUCCESS;
    }
    match (study.run)(arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}\nUsage: {} {}", study.name, study.arguments);
            ExitCode::from(2)
        }
    }
}

fn is_help(word: &str) -> bool {
    matches!(word, "--help" | "-h")
}

fn list() {
    println!("Usage: cargo run --release -p trueline-studies -- NAME [ARGUMENTS]\n");
    for study in &STUDIES {
        println!("  {:<16} {}", study.name, study.about);
    }
    println!("\n`NAME --help` prints the arguments of a study.");
}
