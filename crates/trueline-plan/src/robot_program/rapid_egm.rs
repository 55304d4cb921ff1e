//! The RAPID module that goes with a scan: the robot's own program for the path, or the guidance that the PC fills.
//!
//! Syntax after ABB's application manual 3HAC073318 and the RAPID reference. No real controller has compiled it here, and
//! the module states this.

use super::language::Language;
use super::program_file::ProgramFile;
use super::rapid_path::{path_procedure, target};
use super::waypoints::Waypoints;
use std::fmt::Write;
use std::net::SocketAddr;
use trueline_dataset::RobotSample;
use trueline_geometry::statistics::median;

/// Names and figures of the user's cell.
#[derive(Clone, Debug, PartialEq)]
pub struct RapidCell {
    /// Name of the module and stem of its procedures.
    pub module: String,
    /// Tool data, for example `tool0`.
    pub tool: String,
    /// Work object, for example `wobj0`.
    pub work_object: String,
    /// Name of the UDPUC device in the configuration.
    pub device: String,
    /// Mechanical unit that is guided, for example `ROB_1`.
    pub mechanical_unit: String,
    /// The task that moves it, into which the module is loaded: `T_ROB1` if there is one robot.
    pub task: String,
    /// Address of the PC.
    pub pc: SocketAddr,
    /// Speed of the way to the path's first pose, mm/s.
    pub approach_mm_s: f64,
    /// Largest joint speed that guidance may ask for (`\MaxSpeedDeviation`), deg/s.
    pub speed_deviation_deg_s: f64,
    /// `\CommTimeout`, s.
    pub timeout_s: f64,
    /// Digital output that is sent along with the poses (`\DOToSensor`), if any.
    pub signal: Option<String>,
}

/// Why no module is written.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RapidError {
    /// A name that RAPID does not take.
    #[error(
        "`{name}` is not a RAPID name: a letter, then letters, digits and _, 25 at most, and not one of its words"
    )]
    Name {
        /// The name.
        name: String,
    },
    /// A figure that makes no sense.
    #[error("{what} must be from 0.01 to 1000")]
    Figure {
        /// Which one.
        what: &'static str,
    },
    /// A path without length.
    #[error("the path has no two poses at rising times")]
    Path,
}

/// RAPID takes 32 letters, and procedures are named after the module with seven more.
const LONGEST_NAME: usize = 25;
/// Words that the module itself uses for something else.
const TAKEN: [&str; 14] = [
    "module",
    "endmodule",
    "proc",
    "endproc",
    "const",
    "var",
    "error",
    "return",
    "raise",
    "local",
    "tlNoCorr",
    "tlNearMm",
    "tlNearDeg",
    "tlEgmId",
];

/// Who drives while poses are exchanged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Driver {
    /// The robot's own program, along the path. The PC only listens.
    Robot,
    /// The PC's references (`trueline scan --enable-motion`).
    Pc,
}

/// The module, for the task that moves the robot.
///
/// # Errors
/// Names or figures that RAPID does not take, or no path.
pub fn file(cell: &RapidCell, driver: Driver, path: &[RobotSample]) -> Result<ProgramFile, RapidError> {
    let text = match driver {
        Driver::Robot => stream_module(cell, path),
        Driver::Pc => guidance_module(cell, path),
    }?;
    Ok(ProgramFile::with_dos_lines(format!("{}.mod", cell.module), Language::Rapid.goes_to(), &text))
}

/// The module that moves the robot along the path by itself while the PC only listens.
fn stream_module(cell: &RapidCell, path: &[RobotSample]) -> Result<String, RapidError> {
    let waypoints = Waypoints::of(path).ok_or(RapidError::Path)?;
    let mut text = head(cell, "the robot follows the path by itself; the PC only listens")?;
    let RapidCell { module, tool, work_object, device, mechanical_unit, .. } = cell;
    let signal = signal(cell);
    let _ = write!(
        text,
        "  LOCAL VAR egmident tlEgmId;\n\n\
         \x20 PROC {module}_Listen()\n\
         \x20   ConfJ\\Off;\n\
         \x20   ConfL\\Off;\n\
         \x20   ! First the move to the start of the path. Check this point before you run the program.\n\
         \x20   MoveJ {}, {}, fine, {tool}\\WObj:={work_object};\n\
         \x20   WaitTime\\InPos, 1;\n\
         \x20   EGMReset tlEgmId;\n\
         \x20   EGMGetId tlEgmId;\n\
         \x20   EGMSetupUC {mechanical_unit}, tlEgmId, \"default\", \"{device}\"\\Pose;\n\
         \x20   EGMActPose tlEgmId\\StreamStart\\Tool:={tool}\\WObj:={work_object}{signal}, tlNoCorr, EGM_FRAME_WOBJ, tlNoCorr, EGM_FRAME_WOBJ\\SampleRate:=4;\n\
         \x20   WaitTime 1;\n\
         \x20   {module}_Path;\n\
         \x20   WaitTime 1;\n\
         \x20   EGMStreamStop tlEgmId;\n\
         \x20   EGMReset tlEgmId;\n\
         \x20   ConfL\\On;\n\
         \x20   ConfJ\\On;\n\
         \x20 ERROR\n\
         \x20   EGMReset tlEgmId;\n\
         \x20   ConfL\\On;\n\
         \x20   ConfJ\\On;\n\
         \x20   RAISE;\n\
         \x20 ENDPROC\n\n",
        target(&waypoints.list[0].pose),
        approach(cell),
    );
    text.push_str(&path_procedure(module, &waypoints, tool, work_object));
    text.push_str("ENDMODULE\n");
    Ok(text)
}

/// The module with which the PC guides the robot.
fn guidance_module(cell: &RapidCell, path: &[RobotSample]) -> Result<String, RapidError> {
    let first = path.first().ok_or(RapidError::Path)?;
    let (near_mm, near_deg) = arrived(path)?;
    let mut text = head(cell, "the PC guides the robot along the path")?;
    let RapidCell {
        module,
        tool,
        work_object,
        device,
        mechanical_unit,
        speed_deviation_deg_s,
        timeout_s,
        ..
    } = cell;
    let signal = signal(cell);
    let _ = write!(
        text,
        "  LOCAL VAR egmident tlEgmId;\n\
         \x20 ! Staying within these for \\CondTime counts as arrived. Each is a fifth of the path's motion during\n\
         \x20 ! the robot's typical delay. Wider ones would mistake a slow path for its end and stop the guidance early.\n\
         \x20 LOCAL CONST egm_minmax tlNearMm := [-{near_mm:.4}, {near_mm:.4}];\n\
         \x20 LOCAL CONST egm_minmax tlNearDeg := [-{near_deg:.4}, {near_deg:.4}];\n\n\
         \x20 PROC {module}_Guide()\n\
         \x20   ConfJ\\Off;\n\
         \x20   ConfL\\Off;\n\
         \x20   ! First the move to the start of the path, to a fine point. Check this point before you run the program.\n\
         \x20   MoveJ {}, {}, fine, {tool}\\WObj:={work_object};\n\
         \x20   WaitTime\\InPos, 1;\n\
         \x20   EGMReset tlEgmId;\n\
         \x20   EGMGetId tlEgmId;\n\
         \x20   EGMSetupUC {mechanical_unit}, tlEgmId, \"default\", \"{device}\"\\Pose\\CommTimeout:={timeout_s:.3};\n\
         \x20   EGMActPose tlEgmId\\StreamStart\\Tool:={tool}\\WObj:={work_object}{signal}, tlNoCorr, EGM_FRAME_WOBJ, tlNoCorr, EGM_FRAME_WOBJ\n\
         \x20     \\x:=tlNearMm\\y:=tlNearMm\\z:=tlNearMm\\rx:=tlNearDeg\\ry:=tlNearDeg\\rz:=tlNearDeg\n\
         \x20     \\LpFilter:=20\\SampleRate:=4\\MaxPosDeviation:=60\\MaxSpeedDeviation:={speed_deviation_deg_s:.2};\n\
         \x20   ! EGM_STOP_HOLD holds the position; EGM_STOP_RAMP_DOWN would drive back to the start.\n\
         \x20   EGMRunPose tlEgmId, EGM_STOP_HOLD\\x\\y\\z\\rx\\ry\\rz\\CondTime:=3\\RampInTime:=0.5;\n\
         \x20   EGMReset tlEgmId;\n\
         \x20   ConfL\\On;\n\
         \x20   ConfJ\\On;\n\
         \x20 ERROR\n\
         \x20   EGMReset tlEgmId;\n\
         \x20   ConfL\\On;\n\
         \x20   ConfJ\\On;\n\
         \x20   IF ERRNO = ERR_UDPUC_COMM THEN\n\
         \x20     TPWrite \"{module}: the PC is silent\";\n\
         \x20     RETURN;\n\
         \x20   ENDIF\n\
         \x20   RAISE;\n\
         \x20 ENDPROC\nENDMODULE\n",
        target(&first.base_from_tool),
        approach(cell),
    );
    Ok(text)
}

/// Typical delay of a robot behind its reference if speed is sent as well, s.
const BEHIND_S: f64 = 0.015;
/// The window, as a share of the way in that time at the path's typical speed.
const WINDOW: f64 = 0.2;

/// Distance, mm, and angle, deg, within which the robot has arrived.
fn arrived(path: &[RobotSample]) -> Result<(f64, f64), RapidError> {
    let mut speeds: Vec<(f64, f64)> = Vec::new();
    for pair in path.windows(2) {
        let passed_s = (pair[1].stamp_ns - pair[0].stamp_ns) as f64 * 1e-9;
        if passed_s <= 0.0 {
            return Err(RapidError::Path);
        }
        let [from, to] = [pair[0].base_from_tool, pair[1].base_from_tool];
        let way_m = (to.translation.vector - from.translation.vector).norm();
        speeds.push((way_m / passed_s, from.rotation.angle_to(&to.rotation) / passed_s));
    }
    let speed_m_s = median(speeds.iter().map(|(speed, _)| *speed)).ok_or(RapidError::Path)?;
    let turn_rad_s = median(speeds.iter().map(|(_, turn)| *turn)).ok_or(RapidError::Path)?;
    let window = |per_s: f64| (WINDOW * BEHIND_S * per_s).clamp(0.001, 0.05);
    Ok((window(speed_m_s * 1e3), window(turn_rad_s.to_degrees())))
}

fn head(cell: &RapidCell, what: &str) -> Result<String, RapidError> {
    let RapidCell { module, tool, work_object, device, mechanical_unit, task, .. } = cell;
    for name in [module, tool, work_object, device, mechanical_unit, task].into_iter().chain(&cell.signal) {
        let mut letters = name.chars();
        let begins = letters.next().is_some_and(|c| c.is_ascii_alphabetic())
            && !TAKEN.iter().any(|taken| taken.eq_ignore_ascii_case(name));
        if !begins || !letters.all(|c| c.is_ascii_alphanumeric() || c == '_') || name.len() > LONGEST_NAME {
            return Err(RapidError::Name { name: name.clone() });
        }
    }
    let figures = [
        ("the approach speed", cell.approach_mm_s),
        ("the speed deviation", cell.speed_deviation_deg_s),
        ("the timeout", cell.timeout_s),
    ];
    if let Some((what, _)) = figures.into_iter().find(|(_, value)| !(0.01..=1000.0).contains(value)) {
        return Err(RapidError::Figure { what });
    }
    let pc = cell.pc;
    Ok(format!(
        "MODULE {module}\n\
         \x20 ! Written by trueline: {what}.\n\
         \x20 !\n\
         \x20 ! NOT TRIED ON A REAL CONTROLLER: neither compiled nor run there by those who wrote this generator.\n\
         \x20 ! Check it in RobotStudio first, then run it in manual reduced speed with the enabling device in hand.\n\
         \x20 !\n\
         \x20 ! Reach, singularities and collisions of the arm are not checked.\n\
         \x20 ! Load it into the task {task}, which is to be the one that moves {mechanical_unit}.\n\
         \x20 !\n\
         \x20 ! Needs Externally Guided Motion (RobotWare 6: 689-1, RobotWare 7: 3124-1), and a UDPUC device:\n\
         \x20 !   name {device}, type UDPUC, remote address {}, remote port {}\n\
         \x20 !   RobotWare 6: Configuration, Communication, Transmission Protocol\n\
         \x20 !   RobotWare 7: Configuration, Communication, UDP Unicast Device; and UDPUC allowed in the firewall\n\
         \x20 ! then restart the controller. Start the PC's program before this one.\n\
         \x20 !\n\
         {}\
         \x20 ! Poses are of {tool} in {work_object}. The calibration is relative to that tool: keep it.\n\
         \x20 LOCAL CONST pose tlNoCorr := [[0, 0, 0], [1, 0, 0, 0]];\n",
        pc.ip(),
        pc.port(),
        cell.signal.as_ref().map_or_else(String::new, |signal| format!(
            "\x20 ! {signal} is sent along with the poses (\\DOToSensor, RobotWare 7.7 and later). EGM sends outputs alone: let a\n\
             \x20 ! cross connection of the I/O configuration set {signal} from the input that the camera is wired to.\n"
        )),
    ))
}

fn signal(cell: &RapidCell) -> String {
    cell.signal.as_ref().map_or_else(String::new, |signal| format!("\\DOToSensor:={signal}"))
}

fn approach(cell: &RapidCell) -> String {
    format!("[{:.1}, 20, 200, 15]", cell.approach_mm_s)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use nalgebra::Vector3;
    use trueline_geometry::{Pose, so3};

    fn cell() -> RapidCell {
        RapidCell {
            module: "LineScan".to_owned(),
            tool: "tool0".to_owned(),
            work_object: "wobj0".to_owned(),
            device: "UCdevice".to_owned(),
            mechanical_unit: "ROB_1".to_owned(),
            task: "T_ROB1".to_owned(),
            pc: "192.168.125.10:6510".parse().unwrap(),
            approach_mm_s: 20.0,
            speed_deviation_deg_s: 30.0,
            timeout_s: 0.2,
            signal: None,
        }
    }

    fn path() -> Vec<RobotSample> {
        (0..=2500)
            .map(|k| {
                let t = f64::from(k) * 0.004;
                let position = Vector3::new(0.8 + 0.03 * t, 0.02 * (2.0 * t).sin(), 0.5);
                let rotation = so3::exp(&Vector3::new(3.0, 0.1 * (1.5 * t).sin(), 0.0));
                RobotSample {
                    stamp_ns: k.into(),
                    device_ns: None,
                    base_from_tool: Pose::from_parts(position.into(), rotation),
                }
            })
            .map(|mut sample| {
                sample.stamp_ns *= 4_000_000;
                sample
            })
            .collect()
    }

    /// Reads the moves back and compares with the path at their times.
    #[test]
    fn the_moves_are_on_the_path_at_their_times() {
        let text = stream_module(&cell(), &path()).unwrap();
        let mut time_s = 0.0;
        let moves: Vec<&str> = text.lines().filter(|line| line.contains("\\T:=")).collect();
        assert!(moves.len() > 40 && moves.len() < 250, "{}", moves.len());
        for line in &moves {
            let numbers: Vec<f64> = line
                .replace("v100", "")
                .split(|c: char| !(c.is_ascii_digit() || c == '.' || c == '-'))
                .filter_map(|word| word.parse().ok())
                .collect();
            let after = line.split("\\T:=").nth(1).unwrap();
            time_s += after.split(',').next().unwrap().parse::<f64>().unwrap();
            let sample = &path()[(time_s / 0.004).round() as usize];
            let p = sample.base_from_tool.translation.vector * 1e3;
            for axis in 0..3 {
                assert!((numbers[axis] - p[axis]).abs() < 6e-4, "{line}");
            }
            let q = sample.base_from_tool.rotation.quaternion();
            assert!((numbers[3] - q.w).abs() < 1e-7 && (numbers[4] - q.i).abs() < 1e-7);
        }
        assert!((time_s - 10.0).abs() < 1e-9);
        assert!(moves.last().unwrap().contains("fine"));
    }

    #[test]
    fn both_modules_say_that_nobody_tried_them_and_name_the_users_cell() {
        for text in [stream_module(&cell(), &path()).unwrap(), guidance_module(&cell(), &path()).unwrap()] {
            assert!(text.starts_with("MODULE LineScan\n") && text.ends_with("ENDMODULE\n"));
            for needed in ["NOT TRIED", "192.168.125.10", "6510", "tool0", "wobj0", "UCdevice", "T_ROB1"] {
                assert!(text.contains(needed), "{needed}");
            }
            assert_eq!(text.matches("PROC ").count(), text.matches("ENDPROC").count());
        }
    }

    #[test]
    fn a_signal_is_sent_along_where_one_is_named() {
        let wired = RapidCell { signal: Some("doCamera".to_owned()), ..cell() };
        for (with, without) in [
            (stream_module(&wired, &path()), stream_module(&cell(), &path())),
            (guidance_module(&wired, &path()), guidance_module(&cell(), &path())),
        ] {
            let (with, without) = (with.unwrap(), without.unwrap());
            assert!(
                with.contains("\\WObj:=wobj0\\DOToSensor:=doCamera, tlNoCorr")
                    && !without.contains("DOToSensor")
            );
            let others =
                with.lines().filter(|line| !line.contains("doCamera") && !line.contains("cross connection"));
            assert!(others.eq(without.lines().filter(|line| !line.contains("EGMActPose"))));
        }
        let bad = RapidCell { signal: Some("di 1".to_owned()), ..cell() };
        assert!(matches!(stream_module(&bad, &path()), Err(RapidError::Name { .. })));
    }

    #[test]
    fn names_that_rapid_does_not_take_are_refused() {
        for bad in ["", "1tool", "my tool", "a-b", "t;Stop", "averylongnamethatrapidwouldnotacceptatall"] {
            let bad_tool = RapidCell { tool: bad.to_owned(), ..cell() };
            assert!(matches!(stream_module(&bad_tool, &path()), Err(RapidError::Name { .. })), "{bad}");
            let bad_task = RapidCell { task: bad.to_owned(), ..cell() };
            assert!(matches!(guidance_module(&bad_task, &path()), Err(RapidError::Name { .. })), "{bad}");
        }
        let still = RapidCell { approach_mm_s: f64::NAN, ..cell() };
        assert!(matches!(guidance_module(&still, &path()), Err(RapidError::Figure { .. })));
        assert_eq!(stream_module(&cell(), &path()[..1]), Err(RapidError::Path));
    }
}
