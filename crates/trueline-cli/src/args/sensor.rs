//! `trueline sensor`.

use crate::args::choice::{Choice, one_of};
use clap::{Args, Subcommand};
use std::path::PathBuf;
use trueline_sensor::Board;
use trueline_sensor::intrinsics::DistortionModel;
use trueline_sensor::laser_plane::StripeOn;

#[derive(Args)]
pub(crate) struct SensorArgs {
    #[command(subcommand)]
    pub(crate) command: SensorCommand,
}

#[derive(Subcommand)]
pub(crate) enum SensorCommand {
    /// The camera's focal lengths, principal point and distortion, from pictures of a chessboard
    Intrinsics(IntrinsicsArgs),
    /// The laser plane, from the laser's stripe on a board at several poses
    LaserPlane(LaserPlaneArgs),
}

#[derive(Args)]
#[command(after_help = "Examples:
  trueline sensor intrinsics pictures --board chessboard:9x6:25 --out sensor.toml --report camera.html
  trueline sensor intrinsics left*.png --board chessboard:9x6:25mm --json -

How to: print a chessboard, glue it on something flat and measure a square. 9x6 counts the inner corners, where four squares \
meet. Take 10 to 20 sharp pictures with the laser off: the board fills a third to two thirds of the picture, reaches every \
corner of the picture in turn, and is tilted by about 30 degrees to every side. The summary names the \
    picture to add.

--out writes a sensor.toml with [camera] and its uncertainty. `trueline sensor laser-plane --sensor sensor.toml` adds the \
laser plane.

Exit code: 0 accepted, 1 computed but not accepted (reasons listed), 2 could not run.")]
pub(crate) struct IntrinsicsArgs {
    /// A folder of pictures (PNG or JPEG), or the pictures
    #[arg(required = true)]
    pub(crate) pictures: Vec<PathBuf>,
    /// The board: chessboard:COLUMNSxROWS:SQUARE, inner corners and side of a square in mm
    #[arg(long, value_parser = board)]
    pub(crate) board: Board,
    /// Distortion coefficients to estimate
    #[arg(long, value_parser = one_of(&DISTORTIONS), default_value = "auto")]
    pub(crate) distortion: DistortionChoice,
    /// Write sensor.toml; it must not exist
    #[arg(long)]
    pub(crate) out: Option<PathBuf>,
    /// Write the result as JSON; - is stdout
    #[arg(long)]
    pub(crate) json: Option<PathBuf>,
    /// Write a report that opens in a browser
    #[arg(long)]
    pub(crate) report: Option<PathBuf>,
    /// Print no summary
    #[arg(long)]
    pub(crate) quiet: bool,
}

/// Coefficients, or those that the pictures bear out.
pub(crate) type DistortionChoice = Option<DistortionModel>;

static DISTORTIONS: [Choice<DistortionChoice>; 6] = [
    ("auto", "Those that the pictures determine", None),
    ("none", "None", Some(DistortionModel::None)),
    ("k1", "k1", Some(DistortionModel::K1)),
    ("k1-k2", "k1, k2", Some(DistortionModel::K1K2)),
    ("k1-k2-p1-p2", "k1, k2, p1, p2", Some(DistortionModel::K1K2P1P2)),
    ("five", "k1, k2, p1, p2, k3", Some(DistortionModel::Five)),
];

static STRIPE_ON: [Choice<StripeOn>; 2] = [
    ("board", "On the squares only", StripeOn::Board),
    ("sheet", "On the squares and the paper around them", StripeOn::Sheet),
];

#[derive(Args)]
#[command(after_help = "Examples:
  trueline sensor laser-plane stripes --board chessboard:9x6:25 --sensor camera.toml --out sensor.toml
  trueline sensor laser-plane stripes --without-laser boards --board chessboard:9x6:25 --sensor camera.toml --out sensor.toml
  trueline sensor laser-plane stops/poses.csv --plate --sensor camera.toml --initial initial.toml --out sensor.toml
  trueline sensor laser-plane points.csv --json -

From pictures: the laser's stripe falls on the board, and board and stripe are in one picture. If ambient \
light hides the stripe, take two pictures of every pose, with and without laser, under the same name in two folders. Put the board at 10 or more \
poses, near and far, tilted to every side. The stripe may be 0.7 to 40 px wide, saturated, short or broken, and lie on the squares or on \
the paper beside them.
From a plain flat plate and the robot, with --plate: stop 15 to 20 times before the plate, near and far, the tool tilted by 20 \
degrees to every side, the stripe on the plate right across the picture, and write a table: picture,x_mm,y_mm,z_mm,qw,qx,qy,qz, \
the tool's pose at each picture, with the pictures beside the table. The plate may be anywhere but must \
    stand still. --initial \
says roughly how the camera sits on the tool, to 10 degrees and 30 mm; it is estimated with the plane. At one attitude the plane's \
offset cannot be determined, however the tool moves.
From points: columns board,x_mm,y_mm,z_mm: points of the stripe in the camera frame, each with the number of its board.

The uncertainty is estimated from boards, not from points: the points of one board share its errors.

Exit code: 0 accepted, 1 computed but not accepted (reasons listed), 2 could not run.")]
pub(crate) struct LaserPlaneArgs {
    /// A CSV of points, a folder of pictures, or the pictures; with --plate a CSV of pictures and poses
    #[arg(required = true)]
    pub(crate) input: Vec<PathBuf>,
    /// The board in the pictures: chessboard:COLUMNSxROWS:SQUARE
    #[arg(long, value_parser = board)]
    pub(crate) board: Option<Board>,
    /// Folder with the same pictures without the laser
    #[arg(long, requires = "board")]
    pub(crate) without_laser: Option<PathBuf>,
    /// Part of the board to search for the stripe
    #[arg(long, requires = "board", value_parser = one_of(&STRIPE_ON), default_value = "sheet")]
    pub(crate) stripe_on: StripeOn,
    /// A plain plate instead of a board: INPUT is a CSV picture,x_mm,y_mm,z_mm,qw,qx,qy,qz
    #[arg(long, conflicts_with_all = ["board", "without_laser"], requires_all = ["sensor", "initial"])]
    pub(crate) plate: bool,
    /// Approximate pose of the camera on the tool, for --plate: a TOML as for `calibrate --initial`
    #[arg(long, requires = "plate")]
    pub(crate) initial: Option<PathBuf>,
    /// sensor.toml with the camera
    #[arg(long)]
    pub(crate) sensor: Option<PathBuf>,
    /// Write sensor.toml with the laser plane; it must not exist
    #[arg(long)]
    pub(crate) out: Option<PathBuf>,
    /// Write the result as JSON; - is stdout
    #[arg(long)]
    pub(crate) json: Option<PathBuf>,
    /// Print no summary
    #[arg(long)]
    pub(crate) quiet: bool,
}

/// chessboard:9x6:25 or chessboard:9x6:25mm.
pub(crate) fn board(text: &str) -> Result<Board, String> {
    let wrong = || {
        format!(
            "`{text}` is not a board: write chessboard:COLUMNSxROWS:SQUARE_MM, for example chessboard:9x6:25"
        )
    };
    let rest = text.strip_prefix("chessboard:").ok_or_else(wrong)?;
    let (size, square) = rest.split_once(':').ok_or_else(wrong)?;
    let (columns, rows) = size.split_once('x').ok_or_else(wrong)?;
    let [columns, rows] = [columns, rows].map(|n| n.parse::<usize>().ok().filter(|n| (2..=200).contains(n)));
    let square_mm = square.strip_suffix("mm").unwrap_or(square).parse::<f64>().ok();
    match (columns, rows, square_mm.filter(|mm| mm.is_finite() && *mm > 0.0)) {
        (Some(columns), Some(rows), Some(mm)) if columns * rows >= 6 => {
            Ok(Board { columns, rows, square_m: mm / 1000.0 })
        }
        _ => Err(wrong()),
    }
}
