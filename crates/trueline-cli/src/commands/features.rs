//! `trueline features`.

use crate::args::FeaturesArgs;
use crate::failure::Failure;
use crate::pictures::{self, OverlayChoice, PictureOptions};
use crate::{opening, output, picture_report};
use std::process::ExitCode;
use trueline_dataset::picture_names::{self, NamedFrames, PictureStamps};
use trueline_dataset::{Profile, folder, folder_profiles, images};
use trueline_report::picture_page;
use trueline_vision::rare_joint::is_rare;
use trueline_vision::{PictureRegion, StripeChoice};

/// Runs the command.
pub(crate) fn run(args: &FeaturesArgs) -> Result<ExitCode, Failure> {
    if args.dataset.is_file() {
        return Err(opening::not_a_folder(&args.dataset));
    }
    if !images::are_named_in(&args.dataset)?
        && let Some(profiles) = folder_profiles::read(&args.dataset)?
    {
        return of_profiles(args, &profiles);
    }
    output::expect_files(&[&args.dataset], &[args.json.as_deref(), args.report.as_deref()])?;
    write_index(args)?;
    let options = PictureOptions {
        joint: args.joint,
        region: args.region.as_deref().map(region).transpose()?,
        stripe: args.stripe,
        overlay: args.overlay.clone().map(|folder| OverlayChoice {
            folder,
            every: args.overlay_every.get(),
            replace: args.force,
        }),
        threads: args.threads,
        quiet: args.quiet,
    };
    let scan = pictures::examine(&args.dataset, &options)?;
    let (features, summary) = (scan.features(), scan.to_string());
    // The features first: if another output fails, they exist.
    let kept = folder::replace_features(&args.dataset, &features)?;
    let kept = kept.into_iter().chain(folder::replace_stripes(&args.dataset, &scan.stripes())?);
    if !args.quiet {
        kept.for_each(|kept| output::words(&format!("the previous content is now in {}", kept.display())));
    }
    if let Some(file) = &args.json {
        output::json(file, &format!("{:#}", scan.to_json()))?;
    }
    if let Some(file) = &args.report {
        let html = picture_page::html(&picture_page::Source {
            title: &args.dataset.display().to_string(),
            looked: &picture_report::looked(&scan),
            samples: &picture_report::samples(&args.dataset, &scan)?,
            size_px: scan.size_px,
            command: &output::command_line(),
        });
        output::file(file, &html)?;
    }
    if !args.quiet {
        output::summary(args.json.as_deref(), &summary)?;
    }
    if features.is_empty() {
        if !args.quiet {
            output::words("there is no features.csv: no picture shows a seam");
        }
        return Ok(ExitCode::from(1));
    }
    Ok(exit_code(scan.detections().count(), scan.frames.len(), "pictures"))
}

/// A joint found in few pictures is doubtful, even if the user named it.
fn exit_code(shown: usize, of: usize, what: &str) -> ExitCode {
    if !is_rare(shown, of) {
        return ExitCode::SUCCESS;
    }
    output::words(&format!(
        "warning: this joint was found in only {shown} of {of} {what}; check the joint \
        type (--joint)"
    ));
    ExitCode::from(1)
}

/// Writes the index of pictures that have none, where a rate or their names say the stamps.
fn write_index(args: &FeaturesArgs) -> Result<(), Failure> {
    let first_robot_ns = || -> Result<i64, Failure> {
        if !args.dataset.join("robot.csv").exists() {
            return Ok(0);
        }
        let robot = folder::read_robot(&args.dataset)?;
        Ok(robot.samples.first().map_or(0, |sample| sample.stamp_ns))
    };
    let stamps = match (args.fps, args.stamps_from_name) {
        (Some(fps), _) => PictureStamps::Rate { fps, first_ns: first_robot_ns()? },
        (None, Some(unit_ns)) => PictureStamps::Names { unit_ns },
        (None, None) => return Ok(()),
    };
    let NamedFrames { frames, names } = picture_names::frames(&args.dataset, stamps)?;
    images::write_index(&args.dataset, &frames)?;
    if !args.quiet {
        let from = names.words(stamps);
        output::words(&format!("images/index.csv is written for {} pictures: {from}", frames.len()));
    }
    Ok(())
}

/// A rectangle U0,V0,U1,V1 or a polygon U0,V0,U1,V1,U2,V2,…
fn region(text: &str) -> Result<PictureRegion, Failure> {
    let numbers: Result<Vec<f64>, _> = text.split([',', ' ']).map(str::parse).collect();
    let region = numbers.ok().and_then(|numbers| match numbers.as_slice() {
        [u0, v0, u1, v1] => PictureRegion::rectangle([*u0, *u1], [*v0, *v1]),
        more if more.len().is_multiple_of(2) => {
            let corners: Vec<[f64; 2]> = more.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect();
            PictureRegion::polygon(&corners)
        }
        _ => None,
    });
    region.ok_or_else(|| {
        Failure::new(
            format!("--region {text}: expected U0,V0,U1,V1 with U0 < U1 and V0 < V1, or three or more corners U,V,U,V,…"),
            "for example --region 200,100,2200,1900",
        )
    })
}

/// The seams of whole profiles.
fn of_profiles(args: &FeaturesArgs, profiles: &[Profile]) -> Result<ExitCode, Failure> {
    let for_pictures = [
        ("--region", args.region.is_some()),
        ("--stripe", args.stripe != StripeChoice::Strongest),
        ("--overlay", args.overlay.is_some()),
        ("--fps", args.fps.is_some()),
        ("--stamps-from-name", args.stamps_from_name.is_some()),
        ("--report", args.report.is_some()),
        ("--json", args.json.is_some()),
    ];
    if let Some((option, _)) = for_pictures.iter().find(|(_, given)| *given) {
        return Err(Failure::new(
            format!("`{option}` is for pictures, and {} has profiles", args.dataset.display()),
            "leave it out: of the options only --joint is for profiles",
        ));
    }
    let Some(found) = opening::in_profiles_if_any(profiles, args.joint, args.quiet)? else {
        return Ok(ExitCode::from(1));
    };
    let kept = folder::replace_features(&args.dataset, &found.features)?;
    let kept = kept.into_iter().chain(folder::replace_stripes(&args.dataset, &found.stripes)?);
    if !args.quiet {
        kept.for_each(|kept| output::words(&format!("the previous content is now in {}", kept.display())));
    }
    let shown = found.features.chunk_by(|one, next| one.stamp_ns == next.stamp_ns).count();
    Ok(exit_code(shown, profiles.len(), "profiles"))
}
