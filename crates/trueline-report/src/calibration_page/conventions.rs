//! Meaning of the numbers, and how to reproduce them.

use super::Source;
use crate::page::Block;
use crate::result;
use trueline_method::Config;

const FRAMES: &str = include_str!("../../assets/frames.svg");

pub(super) fn blocks(source: &Source<'_>) -> Vec<Block> {
    let c = source.calibration;
    let mut blocks = vec![
        Block::Drawing(FRAMES),
        Block::List(
            [
                "base is the robot's base; tool is the frame whose pose the robot reports; camera is x right, y down, z forward.",
                "tool_from_camera maps coordinates in the camera to coordinates in the tool. Rotations are right-handed quaternions w, x, y, z with w ≥ 0.",
                "An image stamped t was exposed at t − time offset: positive means late images. Kalibr's shift has the other sign.",
                "± is one standard deviation: of the rotation about the tool's axes, of the translation along them.",
                "A pixel (0, 0) is the middle of the top-left pixel. The laser plane is n·p = d in the camera.",
                "The line's direction is the direction of the scan. Its moment is point × direction.",
                "Times are seconds since the first row of robot.csv.",
            ]
            .map(str::to_owned)
            .to_vec(),
        ),
    ];
    let mut facts = vec![
        ("made by".to_owned(), format!("trueline {}", env!("CARGO_PKG_VERSION"))),
        ("command".to_owned(), source.command.to_owned()),
        ("options".to_owned(), changed_options(&c.findings.config)),
    ];
    facts.extend(c.findings.inputs.iter().map(|(file, hash)| (file.clone(), format!("SHA-256 {hash}"))));
    blocks.push(Block::Facts(facts));
    blocks
}

fn as_json(config: &Config) -> serde_json::Value {
    serde_json::to_value(result::options(config)).unwrap_or_default()
}

/// Options that differ from their defaults.
fn changed_options(config: &Config) -> String {
    let (used, default) = (as_json(config), as_json(&Config::default()));
    let (Some(used), Some(default)) = (used.as_object(), default.as_object()) else { return String::new() };
    let changed: Vec<String> = used
        .iter()
        .filter(|(name, value)| default.get(*name) != Some(*value))
        .map(|(name, value)| format!("{name} = {value}"))
        .collect();
    if changed.is_empty() { "all defaults".to_owned() } else { changed.join(", ") }
}
