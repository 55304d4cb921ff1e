//! The features of a dataset folder with pictures, as `features.csv` on stdout.
//!
//! `cargo run --release -p trueline-vision --example features_of_folder -- DATASET [JOINT]`
#![allow(clippy::print_stderr, reason = "an example prints")]

use std::error::Error;
use std::path::Path;
use trueline_dataset::{PictureFolder, features_csv, folder};
use trueline_vision::{Detector, Joint, find_seams};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let dataset = arguments.next().ok_or("which dataset folder?")?;
    let named = arguments.next();
    let joint = Joint::ALL.into_iter().find(|joint| Some(joint.name()) == named.as_deref());
    let sensor = folder::read_sensor(Path::new(&dataset))?;
    let detector = Detector::for_sensor(&sensor).ok_or("this sensor takes no pictures")?;
    let scan = find_seams(&PictureFolder::open(Path::new(&dataset))?, &detector, joint, &())?;
    for skipped in scan.reasons() {
        eprintln!("{} x {}: {}", skipped.count, skipped.typical.code(), skipped.typical);
    }
    eprintln!("{} of {}, {:.2} ms", scan.seams().count(), scan.frames.len(), scan.ms_per_picture());
    Ok(features_csv::write(std::io::stdout().lock(), &scan.features())?)
}
