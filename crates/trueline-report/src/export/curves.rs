//! The curve of a seam as text for spreadsheets, viewers and CAD programs.

use std::fmt::Write;

/// Points along a curve, with the ± of each if known; for a closed curve the last is the first again.
#[derive(Clone, Copy, Debug)]
pub struct CurvePoints<'a> {
    /// Points in base, mm.
    pub points_mm: &'a [[f64; 3]],
    /// One standard deviation of each square to the curve, mm.
    pub sigma_mm: &'a [f64],
}

/// One way to write a curve.
#[derive(Clone, Copy, Debug)]
pub struct CurveForm {
    /// Its name on the command line.
    pub name: &'static str,
    /// Its name in a report.
    pub title: &'static str,
    /// Units and order, in words.
    pub convention: &'static str,
    write: fn(CurvePoints<'_>) -> String,
}

impl CurveForm {
    /// The text.
    #[must_use]
    pub fn text(&self, curve: CurvePoints<'_>) -> String {
        (self.write)(curve)
    }
}

/// All of them.
pub const CURVES: [CurveForm; 3] = [
    CurveForm {
        name: "curve-csv",
        title: "Curve as CSV",
        convention: "points along the seam in base, in mm, each with one standard deviation perpendicular to \
            the seam; `evaluate --reference` and `calibrate --seam-cad` read it",
        write: csv,
    },
    CurveForm {
        name: "curve-ply",
        title: "Curve as PLY",
        convention: "vertices along the seam in base, in mm, each with its standard deviation, and the edges between them",
        write: ply,
    },
    CurveForm {
        name: "curve-dxf",
        title: "Curve as DXF",
        convention: "a 3D polyline along the seam in base, in mm ($INSUNITS 4)",
        write: dxf,
    },
];

/// The form of a name.
#[must_use]
pub fn curve_named(name: &str) -> Option<&'static CurveForm> {
    CURVES.iter().find(|form| form.name == name)
}

fn csv(curve: CurvePoints<'_>) -> String {
    let mut text = "x_mm,y_mm,z_mm,sigma_mm\n".to_owned();
    for ([x, y, z], sigma) in curve.points_mm.iter().zip(curve.sigma_mm) {
        let _ = writeln!(text, "{x:.6},{y:.6},{z:.6},{sigma:.6}");
    }
    text
}

fn ply(curve: CurvePoints<'_>) -> String {
    let vertices = curve.points_mm.len();
    let edges = vertices.saturating_sub(1);
    let mut text = format!(
        "ply\nformat ascii 1.0\ncomment a seam in the robot's base, mm\nelement vertex {vertices}\nproperty double x\nproperty double y\n\
         property double z\nproperty double sigma\nelement edge {edges}\nproperty int vertex1\nproperty int vertex2\nend_header\n"
    );
    for ([x, y, z], sigma) in curve.points_mm.iter().zip(curve.sigma_mm) {
        let _ = writeln!(text, "{x:.6} {y:.6} {z:.6} {sigma:.6}");
    }
    for edge in 0..edges {
        let _ = writeln!(text, "{edge} {}", edge + 1);
    }
    text
}

fn dxf(curve: CurvePoints<'_>) -> String {
    let mut text = "0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n4\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n0\nPOLYLINE\n8\nseam\n66\n1\n70\n8\n".to_owned();
    for [x, y, z] in curve.points_mm {
        let _ = write!(text, "0\nVERTEX\n8\nseam\n10\n{x:.6}\n20\n{y:.6}\n30\n{z:.6}\n70\n32\n");
    }
    text.push_str("0\nSEQEND\n8\nseam\n0\nENDSEC\n0\nEOF\n");
    text
}
