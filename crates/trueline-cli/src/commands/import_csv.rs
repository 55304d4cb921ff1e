//! `trueline import csv`.

use crate::args::{ImportCsvArgs, NewFolder};
use crate::failure::Failure;
use crate::{clocks, output};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use trueline_dataset::import::clock::Clock;
use trueline_dataset::import::csv_folder::{CsvFolder, Imported, ProfileSource};
use trueline_dataset::import::foreign_csv::{Rate, TableForm};
use trueline_dataset::import::profiles::{EvenColumns, ProfileFormat, Timing, times};
use trueline_dataset::import::robot_layout::RobotLayout;
use trueline_dataset::import::stop_tables::StopTables;
use trueline_dataset::picture_names::PictureStamps;
use trueline_dataset::{Error, FrameFile, Problem, ProfileForm, WholeFolder};
use trueline_dataset::{folder, images, picture_names, stop_poses};

/// Runs the command.
pub(crate) fn run(args: &ImportCsvArgs) -> Result<ExitCode, Failure> {
    let (Some(src), Some(to)) = (&args.src, &args.folder) else {
        output::data(&list_of_robots())?;
        return Ok(ExitCode::SUCCESS);
    };
    expect_folder(src)?;
    let folder = csv_folder(src, args)?;
    if let Some(stops) = folder.read_stops().map_err(|error| with_mapping(error, args))? {
        return write_stops(&stops, to, args);
    }
    let imported = read(&folder, args)?;
    let camera = imported.camera.as_ref().map(|_| imported.sensor_text());
    let Imported { mut recording, mut profiles, pictures, .. } = imported;
    if args.align_clocks {
        if !pictures.is_empty() {
            return Err(Failure::new(
                "`--align-clocks`: the seam of pictures is not known yet",
                "import without it, and then `trueline calibrate DATASET --align-clocks`",
            ));
        }
        clocks::align_import(&mut recording, &mut profiles)?;
    }
    let whole = WholeFolder::begin(&to.out, to.force)?;
    folder::write(whole.path(), &recording)?;
    if let Some(text) = &camera {
        write_sensor(whole.path(), text)?;
    }
    let found = match (profiles.len(), pictures.len()) {
        (0, 0) => format!("{} features", recording.features.len()),
        (0, count) => {
            copy_pictures(whole.path(), &pictures)?;
            format!("{count} pictures")
        }
        (count, _) => {
            folder::write_profiles(whole.path(), &profiles, ProfileForm::Csv)?;
            format!("{count} profiles")
        }
    };
    output::former_folder(&to.out, whole.finish()?);
    if !to.quiet {
        output::words(&format!(
            "{}: {} robot poses, {found} ({})",
            to.out.display(),
            recording.robot.len(),
            if camera.is_some() { "camera" } else { recording.sensor.kind() },
        ));
    }
    Ok(ExitCode::SUCCESS)
}

fn expect_folder(src: &Path) -> Result<(), Failure> {
    let hint = "SRC is the folder with robot.csv and features.csv, profiles.csv or images/; other names: --robot-file, --features, --profiles";
    match (src.is_dir(), src.exists()) {
        (true, _) => Ok(()),
        (false, true) => Err(Failure::new(format!("{}: is a file; a folder is needed", src.display()), hint)),
        (false, false) => Err(Failure::new(format!("{}: there is no such folder", src.display()), hint)),
    }
}

/// The camera's file in the place of a sensor's.
fn write_sensor(dataset: &Path, text: &str) -> Result<(), Failure> {
    let file = dataset.join("sensor.toml");
    Ok(fs::write(&file, text).map_err(|error| Error::in_file(&file, Problem::Io(error)))?)
}

/// A dataset of a robot that stood at stops.
fn write_stops(stops: &StopTables, to: &NewFolder, args: &ImportCsvArgs) -> Result<ExitCode, Failure> {
    if args.align_clocks {
        return Err(Failure::new("`--align-clocks`: stops have no clock", "import without it"));
    }
    for note in &stops.notes {
        output::words(note);
    }
    let whole = WholeFolder::begin(&to.out, to.force)?;
    stops.write(whole.path())?;
    copy_files(whole.path(), stops.pictures.iter())?;
    let read = match &stops.features {
        Some((_, count)) => format!("{count} features"),
        None => format!("{} pictures", stops.pictures.len()),
    };
    output::former_folder(&to.out, whole.finish()?);
    if !to.quiet {
        output::words(&format!("{}: {} stops, {read}", to.out.display(), stops.stops));
    }
    Ok(ExitCode::SUCCESS)
}

/// One maker a line.
fn list_of_robots() -> String {
    let row = |(name, words): (&str, &str)| {
        let columns = RobotLayout::usual_columns(name).unwrap_or_default();
        format!("{name:<11} {words}\n{:<11} columns: {columns}\n", "")
    };
    RobotLayout::list().map(row).collect()
}

/// Pictures and their index, into a folder that is being written.
fn copy_pictures(dataset: &Path, pictures: &[FrameFile]) -> Result<(), Failure> {
    copy_files(dataset, pictures.iter().map(|picture| &picture.path))?;
    Ok(images::write_index(dataset, pictures)?)
}

/// Pictures into a dataset's folder of them.
fn copy_files<'a>(
    dataset: &Path,
    pictures: impl ExactSizeIterator<Item = &'a PathBuf>,
) -> Result<(), Failure> {
    let folder = dataset.join("images");
    let failed = |path: &Path, error: std::io::Error| Failure::from(Error::in_file(path, Problem::Io(error)));
    if pictures.len() > 0 {
        fs::create_dir_all(&folder).map_err(|error| failed(&folder, error))?;
    }
    for picture in pictures {
        let place = folder.join(picture.file_name().unwrap_or_default());
        if place.exists() {
            return Err(Failure::new(
                format!("{}: another picture has the same name in another folder", picture.display()),
                "give all pictures of a scan names of their own: a dataset has them in one folder",
            ));
        }
        fs::copy(picture, place).map_err(|error| match error.kind() {
            std::io::ErrorKind::NotFound => Error::in_file(picture, Problem::NoSuchFile).into(),
            _ => failed(picture, error),
        })?;
    }
    Ok(())
}

/// Reads the files, and reports their recognised form.
fn read(folder: &CsvFolder, args: &ImportCsvArgs) -> Result<Imported, Failure> {
    let imported = folder.read().map_err(|error| with_mapping(error, args))?;
    for note in &imported.notes {
        output::words(note);
    }
    Ok(imported)
}

/// Places of the files and meaning of their columns.
fn csv_folder(src: &Path, args: &ImportCsvArgs) -> Result<CsvFolder, Failure> {
    let maker = args.robot.as_deref().and_then(RobotLayout::named);
    let layout = match args.euler {
        Some(sequence) => Some(RobotLayout::with_sequence(maker.as_ref(), sequence)),
        None => maker,
    };
    let separator = args.delimiter;
    let rate = args.robot_rate_hz.map(|hz| Rate { hz, start_s: args.robot_start_s.unwrap_or(0.0) });
    Ok(CsvFolder {
        robot: robot_file(src, args),
        features: src.join(&args.features),
        profiles: profile_source(src, args)?,
        sensor: in_folder_or_here(src, &args.sensor),
        robot_map: args.robot_map.clone(),
        features_map: args.features_map.clone(),
        layout,
        robot_form: TableForm {
            separator,
            skipped_lines: args.robot_skip_lines,
            columns: args.columns.clone(),
            rate,
        },
        features_form: TableForm {
            separator,
            columns: args.features_columns.clone(),
            ..TableForm::default()
        },
        axes: args.axes.clone(),
        images: picture_names::has_pictures(src).then(|| src.join("images")),
        picture_stamps: match (args.fps, args.stamps_from_name) {
            (Some(fps), _) => Some(PictureStamps::Rate { fps, first_ns: 0 }),
            (None, unit_ns) => unit_ns.map(|unit_ns| PictureStamps::Names { unit_ns }),
        },
    })
}

/// The robot's poses: those of stops if there is no log and none was named.
fn robot_file(src: &Path, args: &ImportCsvArgs) -> PathBuf {
    let (named, stops) = (src.join(&args.robot_file), src.join(stop_poses::FILE));
    let is_usual = args.robot_file == Path::new("robot.csv");
    if is_usual && !named.exists() && stops.exists() { stops } else { named }
}

/// A missing column may have another name: the hint shows how to state it.
fn with_mapping(error: Error, args: &ImportCsvArgs) -> Failure {
    let text = error.to_string();
    let of_robot = error.file.ends_with(&args.robot_file) || error.file.ends_with(stop_poses::FILE);
    match &error.problem {
        Problem::NoSuchFile if of_robot => {
            Failure::new(text, "name the robot's log: --robot-file FILE, looked up in SRC")
        }
        Problem::NoSuchFile if error.file.ends_with("index.csv") => Failure::new(
            text,
            "images/index.csv gives each picture its stamp: time_s,file; or name them with --fps RATE or --stamps-from-name UNIT",
        ),
        Problem::MissingColumn { name, found } => {
            let option = if of_robot { "--robot-map" } else { "--features-map" };
            let rate = match (name.starts_with("time"), of_robot) {
                (true, true) => "; a log without a clock: --robot-rate-hz",
                _ => "",
            };
            let map = similar_names(name, found);
            Failure::new(
                text,
                format!("map the column: {option} '{map}', ours=theirs; our name contains the unit{rate}"),
            )
        }
        Problem::NoRotation { found } if of_robot && found.contains("POS_FOR") => Failure::new(
            text,
            "$POS_FOR is the commanded pose, which the robot follows late: trace $POS_ACT_MES, the measured one",
        ),
        Problem::NoRotation { found } if of_robot && args.robot.is_none() => {
            let header: Vec<String> = found.split(", ").map(str::to_owned).collect();
            match RobotLayout::recognised(&header)[..] {
                [] => error.into(),
                [one] => Failure::new(text, format!("these are the names of one maker: --robot {one}")),
                ref several => Failure::new(
                    text,
                    format!(
                        "state the maker: --robot {}; --list-robots explains each",
                        several.join(", or ")
                    ),
                ),
            }
        }
        Problem::Log(log) if of_robot && matches!(**log, trueline_dataset::LogProblem::NoNames { .. }) => {
            let usual = args.robot.as_deref().and_then(RobotLayout::usual_columns);
            match usual {
                Some(usual) => Failure::new(
                    text,
                    format!("name them in their order, for example --columns {usual}; - is not used"),
                ),
                None => error.into(),
            }
        }
        _ => error.into(),
    }
}

/// The map of a missing column, and of those beside it, onto similar names of a header: `x_mm=tcp_x,y_mm=tcp_y,z_mm=tcp_z`.
fn similar_names(name: &str, found: &str) -> String {
    const BESIDE: [&[&str]; 2] = [&["x", "y", "z"], &["u", "v"]];
    let (stem, unit) = name.rsplit_once('_').unwrap_or((name, ""));
    let is_time = stem == "time";
    let is_like = |theirs: &str, stem: &str| {
        let lower = theirs.to_lowercase();
        let bare = lower.split(['[', '(']).next().unwrap_or_default().trim();
        match is_time {
            true => ["time", "zeit", "stamp"].iter().any(|word| bare.contains(word)),
            false => bare.rsplit(['_', '.', '-', ' ', '/']).next() == Some(stem),
        }
    };
    let theirs = |stem: &str| found.split(", ").find(|theirs| is_like(theirs, stem));
    let stems = BESIDE.into_iter().find(|stems| stems.contains(&stem));
    let stems = stems.filter(|stems| stems.iter().all(|stem| theirs(stem).is_some())).unwrap_or(&[]);
    match stems {
        [] => format!("{name}={}", theirs(stem).unwrap_or("THEIRS")),
        _ => {
            let item = |stem: &&str| format!("{stem}_{unit}={}", theirs(stem).unwrap_or_default());
            stems.iter().map(item).collect::<Vec<_>>().join(",")
        }
    }
}

/// The named profiles, or `profiles.csv` if there are no features.
fn profile_source(src: &Path, args: &ImportCsvArgs) -> Result<Option<ProfileSource>, Failure> {
    let usual = Path::new("profiles.csv");
    let is_there = |file: &Path| src.join(file).exists();
    let file = match &args.profiles {
        Some(file) => file,
        None if is_there(&args.features) => return Ok(None),
        None if is_there(usual) => usual,
        None if picture_names::has_pictures(src) => return Ok(None),
        None => {
            return Err(Failure::new(
                format!(
                    "{}: there is neither {} nor profiles.csv, and there are no pictures in images/",
                    src.display(),
                    args.features.display()
                ),
                "name the file of the sensor: --profiles FILE for whole profiles, --features FILE for seam points",
            ));
        }
    };
    let (timing, clock) = timing(src, args)?;
    let even =
        args.x_start_mm.zip(args.x_step_mm).map(|(first_mm, step_mm)| EvenColumns { first_mm, step_mm });
    Ok(Some(ProfileSource {
        file: src.join(file),
        format: args.profile_format.as_deref().and_then(ProfileFormat::named),
        columns: even,
        timing,
        clock,
        no_return_m: args.no_return_mm.map(|mm| mm * 1e-3),
    }))
}

fn timing(src: &Path, args: &ImportCsvArgs) -> Result<(Option<Timing>, Clock), Failure> {
    if let Some(file) = &args.profile_times {
        let file = src.join(file);
        let times = times::read(&file)?;
        output::words(&format!("{}: {}", file.display(), times.words()));
        let timing = Timing::Stamps { stamps_ns: times.stamps_ns, hz: args.profile_rate_hz };
        return Ok((Some(timing), times.clock));
    }
    let Some(hz) = args.profile_rate_hz else { return Ok((None, Clock::Seconds)) };
    let Some(start) = &args.profile_start_s else {
        return Err(Failure::new(
            "`--profile-rate-hz`: when was the first profile taken?",
            "give it by the robot's clock, to about 1 s: --profile-start-s 1.5, or --profile-start-s \
                14:03:12",
        ));
    };
    let (first_ns, clock) = times::of_text(start).ok_or_else(|| {
        Failure::new(
            format!("`--profile-start-s`: expected seconds, a clock time or a date, found {start}"),
            "for example --profile-start-s 0 --profile-rate-hz 200, or --profile-start-s 14:03:12.5",
        )
    })?;
    Ok((Some(Timing::Rate { first_ns, hz }), clock))
}

fn in_folder_or_here(folder: &Path, file: &Path) -> PathBuf {
    let inside = folder.join(file);
    if !inside.exists() && file.exists() { file.to_owned() } else { inside }
}
