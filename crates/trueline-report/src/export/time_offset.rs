//! Use of a time offset: the rule in one line, and the lines of a program that apply it.

use crate::export::format::{Format, Group, Unsupported};
use crate::number::digits_for;

/// The rule, its place of entry, and the programs, as one text.
pub const FORMAT: Format = Format {
    name: "time-offset",
    aliases: &["offset"],
    title: "How to use the time offset",
    group: Group::Program,
    convention: "The rule, where to enter it, what voids it, and a seam point in base in Python, C++ and RAPID (s).",
    write: |mounting| {
        let offset_s = mounting.time_offset_s.ok_or(Unsupported::NoTimeOffset)?;
        let advice = advice(offset_s).join("\n\n");
        let programs =
            snippets(offset_s).map(|snippet| format!("{}:\n\n{}\n", snippet.language, snippet.text));
        Ok(format!("{}\n\n{advice}\n\n{}", rule(offset_s), programs.join("\n")))
    },
};

/// A program that applies a time offset.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Snippet {
    /// Its language.
    pub language: &'static str,
    /// Its text.
    pub text: String,
}

/// The rule: `true exposure = stamp − 17.663 ms`.
#[must_use]
pub fn rule(time_offset_s: f64) -> String {
    let (sign, size) = if time_offset_s < 0.0 { ("+", -time_offset_s) } else { ("−", time_offset_s) };
    format!("true exposure = stamp {sign} {:.3} ms", size * 1e3)
}

/// The same rule, rounded as the time offset is beside its standard deviation.
#[must_use]
pub(crate) fn rule_with(time_offset_s: f64, sigma_s: Option<f64>) -> String {
    let (sign, size) = if time_offset_s < 0.0 { ("+", -time_offset_s) } else { ("−", time_offset_s) };
    // A time offset that was held has no standard deviation: as exact as `with_sigma` shows it.
    let digits = sigma_s.map_or(4, |sigma_s| digits_for(sigma_s * 1e3));
    format!("true exposure = stamp {sign} {:.digits$} ms", size * 1e3)
}

/// Where to enter it, and what voids it.
#[must_use]
pub fn advice(time_offset_s: f64) -> [String; 3] {
    let late = if time_offset_s < 0.0 { "earlier" } else { "later" };
    [
        format!(
            "Each image is stamped {late} than it was exposed. Interpolate the robot's pose at the true exposure between the two samples \
             around it; then multiply: p_base = base_from_tool(stamp − offset) · tool_from_camera · p_camera."
        ),
        "If the sensor's driver or the robot's controller has a setting for the delay, enter it there instead, once: minus this value in a \
         driver that shifts the stamps, this value in a controller that asks for the sensor's latency."
            .to_owned(),
        "Calibrate again when anything changes that delays an image or a pose: exposure time, image size or region, frame rate, which stamp \
         is used, network, PC, filters of the controller."
            .to_owned(),
    ]
}

/// The same in Python, C++ and RAPID.
#[must_use]
pub fn snippets(time_offset_s: f64) -> [Snippet; 3] {
    let seconds = format!("{:.6}", time_offset_s);
    [
        Snippet {
            language: "Python",
            text: format!(
                "import numpy as np\n\
                 from scipy.spatial.transform import Rotation, Slerp\n\
                 t = stamp - ({seconds})                        # true exposure, s\n\
                 p = np.array([np.interp(t, robot_t, robot_xyz[:, k]) for k in range(3)])\n\
                 R = Slerp(robot_t, Rotation.from_quat(robot_xyzw))(t)\n\
                 p_base = R.apply(T[:3, :3] @ p_camera + T[:3, 3]) + p    # T = tool_from_camera"
            ),
        },
        Snippet {
            language: "C++",
            text: format!(
                "double t = stamp - ({seconds});                  // true exposure, s\n\
                 auto b = std::lower_bound(robot.begin() + 1, robot.end() - 1, t, [](auto& s, double t) {{ return s.t < t; }});\n\
                 auto a = b - 1;\n\
                 double f = (t - a->t) / (b->t - a->t);\n\
                 Eigen::Vector3d p_tool = tool_from_camera * p_camera;\n\
                 Eigen::Vector3d p_base = a->q.slerp(f, b->q) * p_tool + (1 - f) * a->p + f * b->p;"
            ),
        },
        Snippet {
            language: "RAPID",
            text: format!(
                "! p{{}} and tm{{}}: poses of the tool and their times in s; pSensor: tool_from_camera; b: pose\n\
                 t := stamp - ({seconds});\n\
                 i := 1; WHILE tm{{i+1}} < t DO i := i + 1; ENDWHILE\n\
                 f := (t - tm{{i}}) / (tm{{i+1}} - tm{{i}}); b.trans := (1-f)*p{{i}}.trans + f*p{{i+1}}.trans;\n\
                 b.rot := NOrient([(1-f)*p{{i}}.rot.q1+f*p{{i+1}}.rot.q1, (1-f)*p{{i}}.rot.q2+f*p{{i+1}}.rot.q2,\n\
                 \u{20}\u{20}(1-f)*p{{i}}.rot.q3+f*p{{i+1}}.rot.q3, (1-f)*p{{i}}.rot.q4+f*p{{i+1}}.rot.q4]);\n\
                 pBase := PoseVect(PoseMult(b, pSensor), pCamera);"
            ),
        },
    ]
}
