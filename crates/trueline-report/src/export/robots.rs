//! The transform as the controllers of robots write it.

use crate::export::format::{Format, Group};
use crate::export::mounting::Mounting;
use crate::export::number::{deg, m, mm, unit, wxyz};
use trueline_dataset::unit::MM_PER_M;
use trueline_geometry::euler::{XYZ_FIXED, XYZ_INTRINSIC, ZYX_INTRINSIC};
use trueline_geometry::so3;

/// RAPID `tooldata`.
pub(crate) const ABB_TOOLDATA: Format = Format {
    name: "abb-tooldata",
    aliases: &["abb"],
    title: "ABB tooldata",
    group: Group::Robot,
    convention: "RAPID tooldata, held by the robot: mm; quaternion w, x, y, z, normalised again by the controller. The load is not the \
                 sensor's: measure it with LoadIdentify.",
    write: |mounting| {
        let note = "! The load (1 kg) is a placeholder: run LoadIdentify.";
        Ok(format!(
            "{note}\nPERS tooldata tSensor:=[TRUE,{},[1,[0,0,50],[1,0,0,0],0,0,0]];",
            rapid_pose(mounting)
        ))
    },
};

/// RAPID `wobjdata`.
pub(crate) const ABB_WOBJDATA: Format = Format {
    name: "abb-wobjdata",
    aliases: &[],
    title: "ABB wobjdata",
    group: Group::Robot,
    convention: "RAPID wobjdata whose user frame the robot holds (robhold TRUE): mm; quaternion w, x, y, z. Only for a stationary tool.",
    write: |mounting| {
        Ok(format!("PERS wobjdata wSensor:=[TRUE,TRUE,\"\",{},[[0,0,0],[1,0,0,0]]];", rapid_pose(mounting)))
    },
};

/// RAPID `pose`.
pub(crate) const ABB_POSE: Format = Format {
    name: "abb-pose",
    aliases: &[],
    title: "ABB pose",
    group: Group::Robot,
    convention: "RAPID pose: mm; quaternion q1 to q4 = w, x, y, z.",
    write: |mounting| Ok(format!("CONST pose pSensor:={};", rapid_pose(mounting))),
};

/// KRL `$TOOL` and `TOOL_DATA`.
pub(crate) const KUKA_TOOL: Format = Format {
    name: "kuka-tool",
    aliases: &["kuka"],
    title: "KUKA $TOOL",
    group: Group::Robot,
    convention: "KRL: mm; A, B, C in degrees about z, then the new y, then the new x. TOOL_DATA belongs in $config.dat; set LOAD_DATA too.",
    write: |mounting| {
        let frame = krl_frame(mounting);
        Ok(format!("TOOL_DATA[{}]={{{frame}}}\n$TOOL={{FRAME: {frame}}}", mounting.tool_number))
    },
};

/// A KRL `FRAME`.
pub(crate) const KUKA_FRAME: Format = Format {
    name: "kuka-frame",
    aliases: &[],
    title: "KUKA FRAME",
    group: Group::Robot,
    convention: "KRL FRAME: mm; A, B, C in degrees about z, then the new y, then the new x.",
    write: |mounting| Ok(format!("DECL FRAME sensor={{{}}}", krl_frame(mounting))),
};

/// FANUC's tool frame.
pub const FANUC: Format = Format {
    name: "fanuc",
    aliases: &["fanuc-utool"],
    title: "FANUC UTOOL",
    group: Group::Robot,
    convention: "mm; W, P, R in degrees about the fixed x, then y, then z: type them into the tool frame (SETUP, Frames, direct entry). The \
                 pendant keeps three decimals.",
    write: |mounting| {
        let [x, y, z] = translation_mm(mounting);
        let [w, p, r] = XYZ_FIXED.angles(&mounting.tool_from_sensor.rotation).map(deg);
        Ok(format!(
            "UTOOL[{}]\nX = {x}  mm\nY = {y}  mm\nZ = {z}  mm\nW = {w} deg\nP = {p} deg\nR = {r} deg",
            mounting.tool_number
        ))
    },
};

/// URScript `set_tcp`.
pub const UR: Format = Format {
    name: "ur",
    aliases: &["ur-pose"],
    title: "UR",
    group: Group::Robot,
    convention: "URScript pose: x, y, z in m, rotation vector in rad. The installation page wants mm.",
    write: |mounting| {
        let t = mounting.tool_from_sensor.translation.vector;
        let turn = so3::log(&mounting.tool_from_sensor.rotation);
        let [x, y, z] = [t.x, t.y, t.z].map(m);
        let [rx, ry, rz] = [turn.x, turn.y, turn.z].map(unit);
        Ok(format!("set_tcp(p[{x}, {y}, {z}, {rx}, {ry}, {rz}])"))
    },
};

/// Yaskawa's tool window.
pub(crate) const YASKAWA: Format = Format {
    name: "yaskawa",
    aliases: &[],
    title: "Yaskawa",
    group: Group::Robot,
    convention: "mm; Rx, Ry, Rz in degrees about the fixed x, then y, then z: type them into the tool window.",
    write: |mounting| {
        let [x, y, z] = translation_mm(mounting);
        let [rx, ry, rz] = XYZ_FIXED.angles(&mounting.tool_from_sensor.rotation).map(deg);
        Ok(format!(
            "TOOL {}\nX  {x} mm\nY  {y} mm\nZ  {z} mm\nRx {rx} deg\nRy {ry} deg\nRz {rz} deg",
            mounting.tool_number
        ))
    },
};

/// VAL3 tool data.
pub(crate) const STAUBLI: Format = Format {
    name: "staubli",
    aliases: &["val3"],
    title: "Stäubli",
    group: Group::Robot,
    convention: "VAL3 tool in a .dtx file: mm; rx, ry, rz in degrees about x, then the new y, then the new z. Not the angles of FANUC or Yaskawa.",
    write: |mounting| {
        let [x, y, z] = translation_mm(mounting);
        let [rx, ry, rz] = XYZ_INTRINSIC.angles(&mounting.tool_from_sensor.rotation).map(deg);
        Ok(format!(
            "<Data name=\"tSensor\" access=\"public\" xsi:type=\"array\" type=\"tool\" size=\"1\">\n  \
             <Value key=\"0\" x=\"{x}\" y=\"{y}\" z=\"{z}\" rx=\"{rx}\" ry=\"{ry}\" rz=\"{rz}\" fatherId=\"flange[0]\" \
             ioLink=\"valve1\"/>\n</Data>"
        ))
    },
};

fn translation_mm(mounting: &Mounting) -> [String; 3] {
    let t = mounting.tool_from_sensor.translation.vector * MM_PER_M;
    [t.x, t.y, t.z].map(mm)
}

fn rapid_pose(mounting: &Mounting) -> String {
    let q = wxyz(&mounting.tool_from_sensor.rotation).map(unit);
    format!("[[{}],[{}]]", translation_mm(mounting).join(","), q.join(","))
}

fn krl_frame(mounting: &Mounting) -> String {
    let [x, y, z] = translation_mm(mounting);
    let [a, b, c] = ZYX_INTRINSIC.angles(&mounting.tool_from_sensor.rotation).map(deg);
    format!("X {x},Y {y},Z {z},A {a},B {b},C {c}")
}
