//! The first scan, step by step: connect, look, plan, record, calibrate, copy the answer. Nothing here starts anything: the
//! reader runs the command lines.

use super::contents::{Answer, Contents};
use super::step::{Progress, Step, quoted};
use crate::serve::html::{block, escape, facts, list};
use std::path::Path;
use trueline_dataset::result_file::{ResultFile, Status};

/// Places of steps in their order, from 0.
const RECORD: usize = 3;
const CALIBRATE: usize = 4;
/// Milliseconds in a second.
const MS_PER_S: f64 = 1e3;
/// Links to robots, with the options of `listen` for each.
const LINKS: [(&str, &str); 4] = [
    ("ABB (EGM; address of this PC)", "--bind 192.168.125.10:6510"),
    ("KUKA (RSI; address of this PC)", "--protocol kuka-rsi --bind 192.168.1.10:49152"),
    ("Universal Robots (address of the robot)", "--protocol ur-rtde --robot 192.168.0.10"),
    ("FANUC (address of this PC)", "--protocol fanuc-hspo --bind 192.168.1.10:60015"),
];

/// The blocks of the page.
pub(super) fn blocks(folder: &Path, contents: &Contents) -> String {
    let steps = steps(folder, contents);
    // A scan may come from elsewhere: the steps before it are not missing then.
    let begun = [CALIBRATE, RECORD].into_iter().find(|k| steps.get(*k).is_some_and(|step| step.is_done));
    let begun = begun.unwrap_or(0);
    let next = steps.iter().enumerate().position(|(k, step)| k >= begun && !step.is_done);
    let cards: String = steps
        .iter()
        .enumerate()
        .map(|(k, step)| {
            let progress = match next {
                _ if step.is_done => Progress::Done,
                Some(next) if next == k => Progress::Next,
                _ if k < begun => Progress::Skipped,
                _ => Progress::Later,
            };
            block(&format!("step-{k}"), &step.card(k + 1, progress))
        })
        .collect();
    let head = "<p>Run the command lines on this PC. This page starts nothing and sends nothing to the robot. It shows \
                what the folder holds.</p>";
    format!("{head}{cards}")
}

fn steps(folder: &Path, contents: &Contents) -> [Step; 6] {
    let answer = contents.answer.as_ref();
    [
        connect(folder, contents),
        look(folder, contents),
        plan(folder, contents),
        record(folder, contents),
        calibrate(folder, contents),
        Step {
            heading: "Copy the answer",
            words: "Write the transform in the form of your robot, and take the time offset off every stamp."
                .to_owned(),
            commands: export(folder, answer),
            finding: answer.and_then(|answer| answer.result.as_ref().ok()).map(numbers).unwrap_or_default(),
            is_done: false,
        },
    ]
}

/// A file of the folder as one word of a shell.
fn at(folder: &Path, name: &str) -> String {
    quoted(&folder.join(name))
}

fn connect(folder: &Path, contents: &Contents) -> Step {
    let link = at(folder, "link.json");
    let listen = |options: &str| format!("trueline listen {options} --for-s 10 --json {link}");
    Step {
        heading: "Connect",
        words: "Start the robot's own program and listen. Nothing that is sent moves a robot.".to_owned(),
        commands: LINKS.map(|(robot, options)| (robot.to_owned(), listen(options))).to_vec(),
        finding: String::new(),
        is_done: contents.has_link,
    }
}

/// Robot and camera, into a folder.
fn recorded(folder: &Path, name: &str) -> String {
    format!(
        "trueline record --bind 192.168.125.10:6510 --camera 192.168.1.64 --sensor {} --out {} --serve 8081",
        at(folder, "sensor.toml"),
        at(folder, name)
    )
}

fn look(folder: &Path, contents: &Contents) -> Step {
    Step {
        heading: "Look",
        words: format!(
            "Describe the sensor in {}, then record a few seconds and look at the picture: the stripe must be bright but not \
             white, and the seam must be marked.",
            folder.join("sensor.toml").display()
        ),
        commands: vec![(
            "With a camera; its picture is at http://127.0.0.1:8081/".to_owned(),
            format!("{} --for-s 30", recorded(folder, "look")),
        )],
        finding: String::new(),
        is_done: contents.has_sensor,
    }
}

fn plan(folder: &Path, contents: &Contents) -> Step {
    let example = format!("trueline plan --example --out {}", at(folder, "example"));
    let own = format!("trueline plan {} --out {}", at(folder, "cell.toml"), at(folder, "plan"));
    Step {
        heading: "Plan",
        words: "Describe the cell and let the program plan the motion that shows the most within its limits."
            .to_owned(),
        commands: vec![
            ("An example with every key and a comment".to_owned(), example),
            ("Your cell".to_owned(), own),
        ],
        finding: list((!contents.has_cell).then(|| "cell.toml is not in the folder yet".to_owned())),
        is_done: contents.has_plan,
    }
}

fn record(folder: &Path, contents: &Contents) -> Step {
    Step {
        heading: "Record",
        words: "Record while the robot's own program runs the path. Begin two seconds before the motion."
            .to_owned(),
        commands: vec![("Robot and camera".to_owned(), recorded(folder, "scan"))],
        finding: list(contents.recordings.iter().take(1).map(|recording| {
            let state = if recording.is_under_way() { "being written" } else { "finished" };
            format!("{}: {state}", recording.name)
        })),
        is_done: contents.finished().is_some(),
    }
}

fn calibrate(folder: &Path, contents: &Contents) -> Step {
    let newest = contents.finished().map_or("scan", |recording| recording.name.as_str());
    Step {
        heading: "Calibrate",
        words: "One command gives time offset, hand-eye transform and seam, each with its ±.".to_owned(),
        commands: vec![(
            "With a report".to_owned(),
            format!(
                "trueline calibrate {} --json {} --report {}",
                at(folder, newest),
                at(folder, "result.json"),
                at(folder, "result.html")
            ),
        )],
        finding: contents.answer.as_ref().map(verdict).unwrap_or_default(),
        is_done: contents.answer.as_ref().is_some_and(is_accepted),
    }
}

fn export(folder: &Path, answer: Option<&Answer>) -> Vec<(String, String)> {
    let file = quoted(&folder.join(answer.map_or("result.json", |answer| answer.name.as_str())));
    ["abb-tooldata", "kuka-tool", "ur", "fanuc", "ros2"]
        .map(|form| (form.to_owned(), format!("trueline export {file} --as {form}")))
        .to_vec()
}

fn is_accepted(answer: &Answer) -> bool {
    answer.result.as_ref().is_ok_and(|result| result.status == Some(Status::Accepted))
}

/// Verdict of a result about itself.
fn verdict(answer: &Answer) -> String {
    let name = escape(&answer.name);
    match &answer.result {
        Err(why) => format!("<p class=\"state bad\">{name} cannot be read</p><p>{}</p>", escape(why)),
        Ok(_) if is_accepted(answer) => format!("<p class=\"state good\">{name}: accepted</p>"),
        Ok(result) => {
            let reasons = list(result.reasons.iter().map(|reason| reason.text.clone()));
            format!("<p class=\"state bad\">{name}: not accepted</p>{reasons}")
        }
    }
}

/// The numbers to copy.
fn numbers(result: &ResultFile) -> String {
    let number = |value: Option<f64>, digits: usize| {
        value.map_or_else(|| "not determined".to_owned(), |value| format!("{value:.digits$}"))
    };
    let list = |values: &[Option<f64>], digits: usize| {
        values.iter().map(|value| number(*value, digits)).collect::<Vec<_>>().join(", ")
    };
    let offset_ms = result.time_offset_s.map(|offset_s| offset_s * MS_PER_S);
    let sigma_ms = result.sigma.time_offset_s.map(|sigma_s| sigma_s * MS_PER_S);
    let rotation = result.tool_from_camera.rotation_wxyz.map(|wxyz| wxyz.map(Some));
    facts([
        ("time offset (ms)", format!("{} ± {}", number(offset_ms, 3), number(sigma_ms, 3))),
        ("translation x, y, z (mm)", list(&result.tool_from_camera.translation_mm, 3)),
        ("± (mm)", list(&result.sigma.translation_mm, 3)),
        ("rotation w, x, y, z", rotation.map_or_else(|| "not determined".to_owned(), |wxyz| list(&wxyz, 6))),
    ])
}
