//! `trueline features`.

use crate::args::{FeaturesArgs, JointName};
use crate::failure::Failure;
use crate::output;
use crate::pictures::{self, Look};
use std::process::ExitCode;
use trueline_dataset::folder;
use trueline_report::picture_page;
use trueline_vision::Joint;

/// Runs the command.
pub fn run(args: &FeaturesArgs) -> Result<ExitCode, Failure> {
    let look = Look {
        joint: joint(args.joint),
        overlay: args.overlay.clone().map(|folder| (folder, args.overlay_every.get())),
        threads: args.threads,
        quiet: args.quiet,
    };
    let found = pictures::look_at(&args.dataset, &look)?;
    // The features first: whatever else cannot be written, they are there.
    let kept = folder::replace_features(&args.dataset, &found.features())?;
    if let (Some(kept), false) = (kept, args.quiet) {
        output::words(&format!("the features that were there are now in {}", kept.display()));
    }
    if let Some(file) = &args.json {
        output::json(file, &format!("{:#}", found.json()))?;
    }
    if let Some(file) = &args.report {
        let title = args.dataset.display().to_string();
        let size = found.size_px();
        let looked = found.looked();
        let html = picture_page::html(&title, &found.summary(), &looked, size, &output::command_line());
        output::file(file, &html)?;
    }
    if !args.quiet {
        output::summary(args.json.as_deref(), &found.summary())?;
    }
    if found.features().is_empty() {
        if !args.quiet {
            output::words("there is no features.csv: no picture shows a seam");
        }
        return Ok(ExitCode::from(1));
    }
    Ok(ExitCode::SUCCESS)
}

/// The joint of a name; `None` for whatever the pictures show.
pub fn joint(name: JointName) -> Option<Joint> {
    match name {
        JointName::Auto => None,
        JointName::Fillet => Some(Joint::Fillet),
        JointName::Lap => Some(Joint::Lap),
        JointName::VGroove => Some(Joint::VGroove),
        JointName::Butt => Some(Joint::Butt),
    }
}
