//! Under which heading an option stands in the help of a command with many: what everybody needs comes first and alone in `-h`.

/// The options of one heading, by the names that a user types.
type Section = (&'static str, &'static [&'static str]);

/// The help of a command with many options.
struct Layout {
    /// Its name with its command: `import csv`.
    command: &'static str,
    /// Options for everybody, in this order.
    everyday: &'static [&'static str],
    /// All others.
    sections: &'static [Section],
}

/// An option that no section names.
const OTHERS: &str = "More options";
/// Options of every command stand behind its own.
const LAST: usize = 900;

/// Source of a picture, in `record` and `scan`.
const CAMERA: Section =
    ("Camera", &["camera", "replay", "exposure-us", "fps", "trigger", "pixel-format", "laser", "stamp"]);
/// Outputs during a recording.
const LIVE: Section = ("Live estimate and page", &["joint", "want", "serve", "serve-name", "foxglove"]);
/// Signals between simulated devices.
const WIRING: Section =
    ("Signals", &["input-from", "input-delay-ms", "output-to", "output-every-mm", "output-every-ms"]);

/// Every command with more than ten options.
const LAYOUTS: &[Layout] = &[
    Layout {
        command: "calibrate",
        everyday: &["json", "report", "initial", "require"],
        sections: &[
            (
                "Target",
                &[
                    "target",
                    "board",
                    "radius-mm",
                    "at-stops",
                    "joint",
                    "use",
                    "seam-cad",
                    "cad-tolerance-mm",
                    "part-moves",
                ],
            ),
            (
                "Prior knowledge",
                &[
                    "fix",
                    "fixed-sigma",
                    "drawn-line",
                    "drawn-line-sigma-mm",
                    "offset-within",
                    "looks",
                    "accept-partial",
                ],
            ),
            ("Sensor", &["sensor", "write-sensor", "certificate", "operator"]),
            (
                "Noise and accuracy",
                &[
                    "feature-sigma-px",
                    "feature-sigma-mm",
                    "robot-sigma-mm",
                    "stamp-sigma-ms",
                    "robot-accuracy-mm",
                    "feature-bias-px",
                    "feature-bias-mm",
                    "edge-radius-mm",
                    "waviness-mm",
                    "strict",
                ],
            ),
            ("Clocks", &["stamps", "align-clocks"]),
            ("Estimator", &["residual", "loss", "threads"]),
            ("Predicted seam error", &["speed-mm-s", "stand-off-mm"]),
        ],
    },
    Layout {
        command: "record",
        everyday: &["out", "protocol", "bind", "robot", "sensor"],
        sections: &[
            ("Robot", &["inputs", "answer-rsi", "tool"]),
            CAMERA,
            LIVE,
            ("Watch welds", &["watch", "calibration", "tell", "weld-pause-s", "tolerance"]),
            ("Run", &["for-s"]),
        ],
    },
    Layout {
        command: "scan",
        everyday: &["out", "bind", "robot", "limits", "enable-motion"],
        sections: &[
            ("Limits", &["write-limits", "reach-mm", "pace"]),
            ("Robot", &["tool", "hold-s", "timeout-s", "armed-s"]),
            CAMERA,
            LIVE,
            ("Run", &["sensor"]),
        ],
    },
    Layout {
        command: "simulate",
        everyday: &["out", "preset", "plan", "seed", "time-offset-ms"],
        sections: &[
            (
                "Cell",
                &["exact-guess", "random-cell", "axis", "sensors", "wall", "duration-s", "robot-period-ms"],
            ),
            (
                "Noise and faults",
                &[
                    "noise-free",
                    "feature-noise-px",
                    "feature-noise-mm",
                    "robot-noise-mm",
                    "stamp-jitter-ms",
                    "clock-drift-ppm",
                    "outliers",
                    "drops",
                    "fault",
                ],
            ),
            (
                "Plates and whole stripes",
                &[
                    "plates",
                    "bow-mm",
                    "twist-mm",
                    "roughness-mm",
                    "plates-deg",
                    "step-mm",
                    "one-plate",
                    "gap-mm",
                    "mismatch-mm",
                    "column-noise-px",
                ],
            ),
            ("Profiles", &["parquet", "profile-look"]),
            ("Curved seams", &["seam", "seam-passes", "seam-tilt-deg", "seam-weave-hz"]),
            (
                "Sightings of a target's pose",
                &["sightings", "target", "radius-mm", "motion", "sighting-count", "stops", "state-noise"],
            ),
            ("Welds of a production", &["production", "layout", "change"]),
            (
                "Pictures",
                &[
                    "images",
                    "joint",
                    "look",
                    "exposure-ms",
                    "opening-deg",
                    "roll-deg",
                    "corner-gap-mm",
                    "bits",
                ],
            ),
            ("Output", &["force"]),
        ],
    },
    Layout {
        command: "import mcap",
        everyday: &["out", "sensor", "pose-topic", "image-topic"],
        sections: &[
            ("Content", &["base", "tool", "urdf", "axis", "allow-jpeg", "no-return-mm", "stamps"]),
            ("Output", &["force"]),
        ],
    },
    Layout {
        command: "import csv",
        everyday: &["out", "robot", "sensor", "features", "profiles"],
        sections: &[
            (
                "Robot log",
                &[
                    "robot-file",
                    "robot-map",
                    "axis",
                    "euler",
                    "robot-rate-hz",
                    "robot-skip-lines",
                    "columns",
                    "list-robots",
                ],
            ),
            (
                "Profiles",
                &[
                    "profile-format",
                    "profile-rate-hz",
                    "profile-start-s",
                    "profile-times",
                    "x-start-mm",
                    "x-step-mm",
                ],
            ),
            ("Tables and clocks", &["features-map", "delimiter", "align-clocks"]),
            ("Output", &["force"]),
        ],
    },
    Layout {
        command: "features",
        everyday: &["joint", "region", "overlay", "json", "report"],
        sections: &[
            ("Pictures", &["stripe", "fps", "stamps-from-name", "overlay-every"]),
            ("Run", &["threads", "force"]),
        ],
    },
    Layout {
        command: "plan",
        everyday: &["out", "calibration", "duration-s", "want", "example"],
        sections: &[
            ("Path", &["longest-s", "shape", "use", "seam-cad", "criterion", "program"]),
            ("Run", &["tries", "seed", "threads"]),
        ],
    },
    Layout {
        command: "evaluate",
        everyday: &["calibration", "reference", "tolerance", "json", "report"],
        sections: &[("Comparison", &["coverage-percent", "static", "fit"]), ("Run", &["csv"])],
    },
    Layout {
        command: "watch",
        everyday: &["state", "calibration", "folder", "json", "tolerance"],
        sections: &[
            ("Alarms", &["tell", "repaired"]),
            ("Live page", &["serve", "serve-name", "also", "foxglove"]),
            ("Run", &["once", "keep-days"]),
        ],
    },
    Layout {
        command: "ros2-node",
        everyday: &["calibration", "sensor", "poses", "profiles", "frames"],
        sections: &[
            ("Messages", &["poses-type", "urdf", "profiles-type", "sensor-frame"]),
            ("Node", &["name", "domain", "network", "for-s"]),
        ],
    },
    Layout {
        command: "robot-program",
        everyday: &["out", "pc", "pace", "signal", "rsi"],
        sections: &[
            (
                "RAPID module with EGM",
                &[
                    "mode",
                    "module",
                    "tool",
                    "work-object",
                    "device",
                    "mechanical-unit",
                    "task",
                    "approach-mm-s",
                ],
            ),
            ("Guidance by EGM", &["speed-deviation-deg-s", "timeout-s"]),
        ],
    },
    Layout {
        command: "robot-sim",
        everyday: &["pc", "path", "mode", "for-s"],
        sections: &[
            (
                "Robot",
                &["from", "wait-for-pc", "rest-s", "robotware", "period-ms", "noise-mm", "feedback-age-ms"],
            ),
            (
                "Guided motion",
                &[
                    "gain-per-s",
                    "low-pass-hz",
                    "dead-time-ms",
                    "timeout-s",
                    "near-mm",
                    "near-deg",
                    "near-for-s",
                    "stop",
                ],
            ),
            ("Clock", &["drift-ppm", "epoch-s", "clock-step"]),
            ("Network", &["delay-ms", "tail-ms", "held-up", "loss", "duplicate", "reorder", "burst"]),
            WIRING,
            ("Run", &["event", "truth-to", "seed"]),
        ],
    },
    Layout {
        command: "stream-sim",
        everyday: &["protocol", "pc", "listen", "path", "for-s"],
        sections: &[
            ("Robot", &["rest-s", "version-of", "period-ms", "await-answers"]),
            ("Clock and network", &["drift-ppm", "loss", "burst"]),
            WIRING,
            ("Run", &["truth-to", "seed"]),
        ],
    },
    Layout {
        command: "camera-sim",
        everyday: &["robot-truth", "address", "fps", "for-s"],
        sections: &[
            ("Trigger", &["trigger-to", "encoder-mm", "trigger-from"]),
            (
                "Pictures",
                &["chunks", "colours", "exposure-ms", "look", "joint", "profiles-per-frame", "exact-guess"],
            ),
            ("Clock and network", &["readout-ms", "latency-ms", "drift-ppm", "epoch-s", "mbit-s"]),
            ("Packets", &["packet-bytes", "loss", "frame-drop", "unplug-at-s"]),
            ("Run", &["truth", "seed"]),
        ],
    },
];

/// Every command below, with its options under their headings.
pub(crate) fn with_headings(command: clap::Command, name: &str) -> clap::Command {
    let last = |arg: clap::Arg| if arg.is_global_set() { arg.display_order(LAST) } else { arg };
    let command = command.mut_args(last).mut_subcommands(|sub| {
        let own = format!("{name} {}", sub.get_name());
        with_headings(sub, own.trim_start())
    });
    match LAYOUTS.iter().find(|layout| layout.command == name) {
        Some(layout) => command.mut_args(|arg| placed(arg, layout)),
        None => command,
    }
}

fn placed(arg: clap::Arg, layout: &Layout) -> clap::Arg {
    let Some(name) = arg.get_long().map(str::to_owned) else { return arg };
    if let Some(rank) = layout.everyday.iter().position(|everyday| *everyday == name) {
        return arg.help_heading(None::<&str>).display_order(rank);
    }
    let section = layout.sections.iter().find(|(_, names)| names.contains(&name.as_str()));
    // A group of options may have brought its own heading.
    let arg = match section {
        Some((heading, _)) => arg.help_heading(*heading),
        None if arg.get_help_heading().is_none() => arg.help_heading(OTHERS),
        None => arg,
    };
    arg.hide_short_help(true)
}
