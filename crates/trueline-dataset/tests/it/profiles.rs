//! Profiles as the makers of sensors export them, made up after the public documentation of each format.

use proptest::prelude::*;
use std::path::Path;
use trueline_dataset::import::profiles::{self, EvenColumns, ProfileFormat, RawProfile, Timing};
use trueline_dataset::{Error, Profile, profiles_csv};

fn read(format: ProfileFormat, text: &str, columns: Option<EvenColumns>) -> Result<Vec<RawProfile>, Error> {
    Ok(profiles::read(Path::new("profiles.txt"), text.as_bytes().to_vec(), format, columns)?.profiles)
}

/// Points in mm, rounded to what files print.
fn in_mm(profile: &RawProfile) -> Vec<[f64; 2]> {
    profile.points.iter().map(|p| [p.x_m, p.z_m].map(|m| (m * 1e9).round() / 1e6)).collect()
}

#[test]
fn our_own_long_form() {
    let text = "time_s,frame,x_mm,z_mm,intensity\n0.1,4,-1,300,12\n0.1,4,0,301,13\n0.2,5,-1,302,14\n";
    let profiles = profiles_csv::read(Path::new("profiles.csv"), text.as_bytes()).unwrap();
    assert_eq!(profiles.len(), 2);
    assert_eq!(
        (profiles[0].stamp_ns, profiles[0].frame, profiles[0].points.len()),
        (100_000_000, Some(4), 2)
    );
    assert_eq!(profiles[1].points[0].intensity, Some(14.0));
    let mut written = Vec::new();
    profiles_csv::write(&mut written, &profiles).unwrap();
    assert_eq!(profiles_csv::read(Path::new("profiles.csv"), written.as_slice()).unwrap(), profiles);
}

/// The symbols for "no return" in other programs' files are not ranges.
#[test]
fn a_huge_number_is_no_measurement() {
    for text in ["time_s,x_mm,z_mm\n0,1,1e300\n", "time_s,x0_mm,dx_mm,z0_mm,z1_mm\n0,1,1,2,-1e300\n"] {
        let refused = profiles_csv::read(Path::new("profiles.csv"), text.as_bytes()).unwrap_err().to_string();
        assert!(refused.contains("profiles.csv, line 2, column `z"), "{refused}");
        assert!(refused.contains("expected a measured number"), "{refused}");
    }
}

#[test]
fn our_own_wide_form_has_holes() {
    let text = "time_s,frame,x0_mm,dx_mm,z0_mm,z1_mm,z2_mm\n0.1,1,-0.5,0.5,300,,302\n0.2,2,-0.5,0.5,,,\n";
    let profiles = profiles_csv::read(Path::new("profiles.csv"), text.as_bytes()).unwrap();
    let points: Vec<[f64; 2]> = profiles[0].points.iter().map(|p| [p.x_m, p.z_m]).collect();
    assert_eq!(points, [[-0.0005, 0.3], [0.0005, 0.302]]);
    assert!(profiles[1].points.is_empty());
    // A column of heights is missing in the middle.
    let broken = "time_s,x0_mm,dx_mm,z0_mm,z2_mm\n0.1,0,1,300,301\n";
    let error = profiles_csv::read(Path::new("profiles.csv"), broken.as_bytes()).unwrap_err().to_string();
    assert!(
        error.contains("column `z1_mm` is missing; the header has: time_s, x0_mm, dx_mm, and 2 heights"),
        "{error}"
    );
    let flat = "time_s,x0_mm,dx_mm,z0_mm,z1_mm\n0.1,0,0,300,301\n";
    let error = profiles_csv::read(Path::new("profiles.csv"), flat.as_bytes()).unwrap_err().to_string();
    assert!(
        error.contains("column `dx_mm`: `dx`: expected the distance of one column from the next, found 0"),
        "{error}"
    );
}

#[test]
fn gocator_with_even_and_with_raw_columns() {
    let start =
        "Info\nCSV Version,Sensor Count,Trigger Mode\n2,1,0\nEnd\nDeviceInfo\nID,Model\n13434,2330\nEnd\n";
    let even = format!(
        "{start}Profile\nFrame Count,Column Count,X Offset,Y Offset,Z Offset\n2,3,0,0,0\n\
         Frame,Source,Time,Encoder,Z Encoder,Inputs,Exposure,Y,Axis,-1.5,0,1.5\n\
         7,0,1000500,0,0,0,100,0,Z,10.25,,10.75\n7,0,1000500,0,0,0,100,0,I,99,,98\n8,0,1010500,0,0,0,100,0,Z,11,12,13\nEnd\n"
    );
    assert_eq!(ProfileFormat::recognised(even.as_bytes()), Some(ProfileFormat::Gocator));
    let profiles = read(ProfileFormat::Gocator, &even, None).unwrap();
    assert_eq!((profiles[0].stamp_ns, profiles[0].frame), (Some(1_000_500_000), Some(7)));
    assert_eq!(in_mm(&profiles[0]), [[-1.5, 10.25], [1.5, 10.75]]);
    assert_eq!(profiles.len(), 2);
    let raw = format!(
        "{start}RawProfile\nFrame Count,Column Count,X Offset,Y Offset,Z Offset\n1,3,0,0,0\n\
         Frame,Source,Time,Encoder,Z Encoder,Inputs,Exposure,Y,Axis,0,1,2\n\
         0,0,5,0,0,0,100,0,X,-2,-1,\n0,0,5,0,0,0,100,0,Z,3,4,5\nEnd\n"
    );
    assert_eq!(in_mm(&read(ProfileFormat::Gocator, &raw, None).unwrap()[0]), [[-2.0, 3.0], [-1.0, 4.0]]);
    // Two sensors look at different places.
    let error = read(ProfileFormat::Gocator, &even.replace("8,0,1010500", "8,1,1010500"), None).unwrap_err();
    assert!(error.to_string().contains("line 15") && error.to_string().contains("one sensor"), "{error}");
}

/// Columns that do not belong together say which point is where; a part of a file is not the file.
#[test]
fn gocator_rows_that_do_not_fit_are_refused_at_their_line() {
    let file = |section: &str, axis: &str, rows: &str| {
        let header = "Frame,Source,Time,Encoder,Z Encoder,Inputs,Exposure,Y,Axis";
        format!("{section}\nFrame Count,Column Count\n2,3\n{header},{axis}\n{rows}End\n")
    };
    let refused = |text: &str| read(ProfileFormat::Gocator, text, None).unwrap_err().to_string();
    let row = |frame: u32, axis: &str, values: &str| format!("{frame},0,5,0,0,0,100,0,{axis},{values}\n");
    let without_x = file("RawProfile", "0,1,2", &row(0, "Z", "3,4,5"));
    assert!(refused(&without_x).contains("line 5: is a row Z of a RawProfile without the row X"));
    let of_another = file("RawProfile", "0,1,2", &(row(0, "X", "-1,0,1") + &row(1, "Z", "3,4,5")));
    assert!(refused(&of_another).contains("line 6: is a row Z"));
    let longer = file("RawProfile", "0,1,2", &(row(0, "X", "-1,0") + &row(0, "Z", "3,4,5")));
    assert!(refused(&longer).contains("line 6: expected 11 fields, found 12"), "{}", refused(&longer));
    let longer = file("Profile", "-1,0,", &row(0, "Z", "3,4,5"));
    assert!(refused(&longer).contains("line 5: expected 11 fields, found 12"), "{}", refused(&longer));
    let hole = file("Profile", "-1,,1", &row(0, "Z", "3,4,5"));
    assert!(refused(&hole).contains("line 4: expected a number, found ``"), "{}", refused(&hole));
    let no_time = file("Profile", "-1,0,1", &row(0, "Z", "3,4,5").replace(",5,0", ",soon,0"));
    assert!(refused(&no_time).contains("line 5: expected a number, found `soon`"), "{}", refused(&no_time));
    // Cells that are empty at the end are those of longer rows.
    let padded = file("Profile", "-1,0,1,,", &row(0, "Z", "3,4,5,,"));
    assert_eq!(read(ProfileFormat::Gocator, &padded, None).unwrap()[0].points.len(), 3);
}

/// Their value marks missing points: a sensor that hangs high measures below −100 mm.
#[test]
fn keyence_heights_below_a_hundred_millimetres_are_heights() {
    let columns = Some(EvenColumns { first_mm: 0.0, step_mm: 1.0 });
    let text = "-150.1234,-99.9999,-99.9990\n-100.0001,-9999.9999,-99999.9999\n";
    let profiles = read(ProfileFormat::KeyenceLjX, text, columns).unwrap();
    assert_eq!(in_mm(&profiles[0]), [[0.0, -150.1234], [2.0, -99.999]]);
    assert_eq!(in_mm(&profiles[1]), [[0.0, -100.0001]]);
    assert_eq!(profiles::left_out_words(&profiles).unwrap(), "3 of 6 values (50.0 %) are not points");
}

#[test]
fn profiles_without_a_single_point_are_refused() {
    let columns = Some(EvenColumns { first_mm: 0.0, step_mm: 1.0 });
    let error =
        read(ProfileFormat::KeyenceLjX, "-99.9999,-99.9999\n-99.9999,-99.9999\n", columns).unwrap_err();
    assert!(error.to_string().ends_with("none of the 2 profiles has a point"), "{error}");
    assert!(error.hint().contains("check the format"));
    let text = "time_s,x0_mm,dx_mm,z0_mm,z1_mm\n0.1,0,1,,\n";
    let error = profiles_csv::read(Path::new("profiles.csv"), text.as_bytes()).unwrap_err();
    assert!(error.to_string().ends_with("none of the 1 profiles has a point"), "{error}");
}

#[test]
fn keyence_columns_of_hundredths_of_a_micrometre() {
    let text = "-150000\t2500000\t2600000\n0\t-2147483648\t2610000\n150000\t2520000\t-524288\n";
    let profiles = read(ProfileFormat::KeyenceLjV, text, None).unwrap();
    assert_eq!(in_mm(&profiles[0]), [[-1.5, 25.0], [1.5, 25.2]]);
    assert_eq!(in_mm(&profiles[1]), [[-1.5, 26.0], [0.0, 26.1]]);
    assert!(read(ProfileFormat::KeyenceLjV, "0\t1.5\n1\t2.5\n", None).is_err());
    // One column after the other, of two profiles that are no longer told apart.
    let error = read(ProfileFormat::KeyenceLjV, "0\t10\n5\t20\n-5\t30\n", None).unwrap_err().to_string();
    assert!(error.contains("line 3: `X`") && error.contains("turns back"), "{error}");
    assert!(read(ProfileFormat::KeyenceLjV, "5\t10\n0\t20\n-5\t30\n", None).is_ok());
}

#[test]
fn keyence_rows_of_millimetres() {
    let text = "LJ-X8080\nDate,2026/11/21\n1.2345,-99.9999,1.3\n1.25,1.26,-9999.9999\n";
    let columns = Some(EvenColumns { first_mm: -8.0, step_mm: 0.005 });
    let profiles = read(ProfileFormat::KeyenceLjX, text, columns).unwrap();
    assert_eq!(in_mm(&profiles[0]), [[-8.0, 1.2345], [-7.99, 1.3]]);
    assert_eq!(in_mm(&profiles[1]), [[-8.0, 1.25], [-7.995, 1.26]]);
    let error = read(ProfileFormat::KeyenceLjX, text, None).unwrap_err();
    assert!(
        error.to_string().contains("the positions of the columns") && error.hint().contains("--x-start-mm")
    );
}

#[test]
fn rows_whose_header_is_the_position() {
    let text = "-1;0;1\n10,5;;10,7\n11,5;11,6;11,7\n";
    let profiles = read(ProfileFormat::Rows, text, None).unwrap();
    assert_eq!(in_mm(&profiles[0]), [[-1.0, 10.5], [1.0, 10.7]]);
    assert_eq!(profiles.len(), 2);
    let wenglor = read(ProfileFormat::Wenglor, "-1,0,1\n10,0,10.5\n", None).unwrap();
    assert_eq!(in_mm(&wenglor[0]), [[-1.0, 10.0], [1.0, 10.5]]);
}

#[test]
fn pairs_as_gopxl_is_logged() {
    let text = "frameIndex,timestamp,encoder,x0,z0,x1,z1\n3,1500,0,-1,20,1,21\n4,2500,0,-1,22,,\n";
    let profiles = read(ProfileFormat::GoPxl, text, None).unwrap();
    assert_eq!((profiles[0].stamp_ns, profiles[0].frame), (Some(1_500_000), Some(3)));
    assert_eq!(in_mm(&profiles[0]), [[-1.0, 20.0], [1.0, 21.0]]);
    assert_eq!(in_mm(&profiles[1]), [[-1.0, 22.0]]);
}

#[test]
fn points_as_scancontrol_and_others_write_them() {
    let asc = "-5.0 120.5\n0.0 0.0\n5.0 121.5\n-5.0 122.5\n0.0 122.6\n";
    let profiles = read(ProfileFormat::ScanControl, asc, None).unwrap();
    assert_eq!(in_mm(&profiles[0]), [[-5.0, 120.5], [5.0, 121.5]]);
    assert_eq!(in_mm(&profiles[1]).len(), 2);
    let long = "frame,x [mm],z [mm],time_ms\n1,0,5,10\n1,1,6,10\n2,0,7,20\n";
    let profiles = read(ProfileFormat::Points, long, None).unwrap();
    assert_eq!((profiles.len(), profiles[1].stamp_ns, profiles[1].frame), (2, Some(20_000_000), Some(2)));
}

#[test]
fn ply_in_all_its_encodings() {
    let header = |format: &str| {
        format!(
            "ply\nformat {format} 1.0\ncomment units mm\nelement vertex 3\nproperty float x\nproperty double y\nproperty float z\n\
             property uchar intensity\nend_header\n"
        )
    };
    let rows: [(f32, f64, f32, u8); 3] = [(-1.5, 0.0, 30.25, 7), (1.5, 0.0, 30.5, 8), (-1.5, 0.1, 31.0, 9)];
    let ascii: String = rows.iter().map(|(x, y, z, i)| format!("{x} {y} {z} {i}\n")).collect();
    let mut files = vec![(header("ascii") + &ascii).into_bytes()];
    for (format, little) in [("binary_little_endian", true), ("binary_big_endian", false)] {
        let mut bytes = header(format).into_bytes();
        for (x, y, z, i) in rows {
            if little {
                bytes.extend([&x.to_le_bytes()[..], &y.to_le_bytes(), &z.to_le_bytes(), &[i]].concat());
            } else {
                bytes.extend([&x.to_be_bytes()[..], &y.to_be_bytes(), &z.to_be_bytes(), &[i]].concat());
            }
        }
        files.push(bytes);
    }
    for bytes in files {
        assert_eq!(ProfileFormat::recognised(&bytes), Some(ProfileFormat::Ply));
        let cut = bytes[..bytes.len() - 6].to_vec();
        let profiles = profiles::read(Path::new("a.ply"), bytes, ProfileFormat::Ply, None).unwrap().profiles;
        assert_eq!(in_mm(&profiles[0]), [[-1.5, 30.25], [1.5, 30.5]]);
        assert_eq!(in_mm(&profiles[1]), [[-1.5, 31.0]]);
        assert!(profiles::read(Path::new("a.ply"), cut, ProfileFormat::Ply, None).is_err());
    }
}

#[test]
fn profiles_get_their_stamps_or_a_hint() {
    let raw = || read(ProfileFormat::Rows, "-1,0,1\n1,2,3\n4,5,6\n", None).unwrap();
    let stamps = |timing: Option<Timing>| -> Result<Vec<Profile>, Error> {
        profiles::stamped(Path::new("p.csv"), raw(), timing.as_ref())
    };
    let at = |profiles: Vec<Profile>| profiles.iter().map(|p| p.stamp_ns).collect::<Vec<_>>();
    assert_eq!(at(stamps(Some(Timing::Rate { first_ns: 5, hz: 100.0 })).unwrap()), [5, 10_000_005]);
    let listed = |stamps_ns: &[i64], hz| stamps(Some(Timing::Stamps { stamps_ns: stamps_ns.to_vec(), hz }));
    assert_eq!(at(listed(&[3, 4], None).unwrap()), [3, 4]);
    assert!(listed(&[3], None).unwrap_err().to_string().contains("1 stamps for 2 profiles"));
    // One stamp for every two profiles, which follow each other at a rate.
    assert_eq!(at(listed(&[3], Some(100.0)).unwrap()), [3, 10_000_003]);
    assert!(listed(&[4, 3], None).unwrap_err().to_string().contains("time runs backwards"));
    assert!(stamps(None).unwrap_err().hint().contains("--profile-rate-hz"));
}

proptest! {
    /// For any bytes in a file, reading ends in profiles or in an error, never in a panic.
    #[test]
    fn any_bytes_are_survived(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
        let headed = [b"ply\nformat binary_little_endian 1.0\nelement vertex 9999999999999\nproperty float x\nproperty int z\nproperty char y\nend_header\n".to_vec(), bytes.clone()].concat();
        let sections = [b"Info\nCSV Version\n2\nEnd\nProfile\na\n1\nFrame,Source,Time,Axis,1,2\n".to_vec(), bytes.clone()].concat();
        for (_, format) in ProfileFormat::ALL {
            for content in [&bytes, &headed, &sections] {
                let _ = profiles::read(Path::new("f"), content.clone(), format, None);
            }
        }
        let _ = profiles_csv::read(Path::new("f"), bytes.as_slice());
    }
}

#[cfg(feature = "parquet")]
mod as_parquet {
    use super::{Error, Path, Profile, profiles_csv};
    use parquet::basic::{Compression, Repetition, Type};
    use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, FloatType, Int32Type, Int64Type};
    use parquet::file::properties::WriterProperties;
    use parquet::file::writer::SerializedFileWriter;
    use std::sync::Arc;
    use trueline_dataset::profiles_parquet;

    enum Values<'a> {
        Real(&'a [f64]),
        Single(&'a [f32]),
        Long(&'a [i64]),
        Short(&'a [i32]),
        Text(&'a [&'a str]),
        /// Numbers with nulls.
        Holed(&'a [Option<f64>]),
    }

    /// A file as another program would write it: compressed by Snappy, as pandas does, in two groups of the same rows.
    fn file(columns: &[(&str, Values<'_>)]) -> Vec<u8> {
        let field = |(name, values): &(&str, Values<'_>)| {
            let (kind, repetition) = match values {
                Values::Real(_) => (Type::DOUBLE, Repetition::REQUIRED),
                Values::Single(_) => (Type::FLOAT, Repetition::REQUIRED),
                Values::Long(_) => (Type::INT64, Repetition::REQUIRED),
                Values::Short(_) => (Type::INT32, Repetition::REQUIRED),
                Values::Text(_) => (Type::BYTE_ARRAY, Repetition::REQUIRED),
                Values::Holed(_) => (Type::DOUBLE, Repetition::OPTIONAL),
            };
            let builder = parquet::schema::types::Type::primitive_type_builder(name, kind);
            Arc::new(builder.with_repetition(repetition).build().unwrap())
        };
        let schema = parquet::schema::types::Type::group_type_builder("table");
        let schema = schema.with_fields(columns.iter().map(field).collect()).build().unwrap();
        let settings = WriterProperties::builder().set_compression(Compression::SNAPPY).build();
        let mut bytes = Vec::new();
        let mut writer = SerializedFileWriter::new(&mut bytes, Arc::new(schema), Arc::new(settings)).unwrap();
        let mut group = writer.next_row_group().unwrap();
        for (_, values) in columns {
            let mut column = group.next_column().unwrap().unwrap();
            match values {
                Values::Real(list) => column.typed::<DoubleType>().write_batch(list, None, None),
                Values::Single(list) => column.typed::<FloatType>().write_batch(list, None, None),
                Values::Long(list) => column.typed::<Int64Type>().write_batch(list, None, None),
                Values::Short(list) => column.typed::<Int32Type>().write_batch(list, None, None),
                Values::Text(list) => {
                    let list: Vec<ByteArray> = list.iter().map(|text| ByteArray::from(*text)).collect();
                    column.typed::<ByteArrayType>().write_batch(&list, None, None)
                }
                Values::Holed(list) => {
                    let known: Vec<f64> = list.iter().flatten().copied().collect();
                    let levels: Vec<i16> = list.iter().map(|value| i16::from(value.is_some())).collect();
                    column.typed::<DoubleType>().write_batch(&known, Some(&levels), None)
                }
            }
            .unwrap();
            column.close().unwrap();
        }
        group.close().unwrap();
        writer.close().unwrap();
        bytes
    }

    fn read(columns: &[(&str, Values<'_>)]) -> Result<Vec<Profile>, Error> {
        profiles_parquet::read(Path::new("profiles.parquet"), file(columns))
    }

    fn refused(columns: &[(&str, Values<'_>)]) -> String {
        read(columns).unwrap_err().to_string()
    }

    #[test]
    fn the_same_as_the_text() {
        let text = "time_s,frame,x_mm,z_mm,intensity\n0.1,4,-1,300,12\n0.1,4,0,301,13\n0.2,5,-1,302,14\n";
        let profiles = profiles_csv::read(Path::new("profiles.csv"), text.as_bytes()).unwrap();
        let bytes = profiles_parquet::bytes(&profiles).unwrap();
        assert_eq!(profiles_parquet::read(Path::new("profiles.parquet"), bytes).unwrap(), profiles);
    }

    #[test]
    fn numbers_of_any_width_and_unit_and_holes() {
        let profiles = read(&[
            ("z_mm", Values::Holed(&[Some(300.0), None, Some(f64::NAN), Some(301.0)])),
            ("x_m", Values::Single(&[0.5, 0.25, 0.75, -0.5])),
            (
                "time_us",
                Values::Long(&[
                    1_700_000_000_000_001,
                    1_700_000_000_000_001,
                    1_700_000_000_000_001,
                    1_700_000_000_000_900,
                ]),
            ),
            ("frame", Values::Short(&[7, 7, 7, 8])),
        ])
        .unwrap();
        // These fractions of powers of two are exact.
        let points = |k: usize| profiles[k].points.iter().map(|p| [p.x_m, p.z_m]).collect::<Vec<_>>();
        assert_eq!(profiles.iter().map(|p| p.frame).collect::<Vec<_>>(), [Some(7), Some(8)]);
        assert_eq!(profiles[0].stamp_ns, 1_700_000_000_000_001_000);
        assert_eq!(profiles[1].stamp_ns - profiles[0].stamp_ns, 899_000);
        assert_eq!((points(0), points(1)), (vec![[0.5, 0.3]], vec![[-0.5, 0.301]]));
    }

    #[test]
    fn what_is_no_table_of_profiles_is_refused_by_name() {
        let x = || ("x_mm", Values::Real(&[1.0, 2.0]));
        let z = || ("z_mm", Values::Real(&[1.0, 2.0]));
        let time = |list| ("time_s", Values::Real(list));
        assert!(refused(&[x(), z()]).contains("time_s"));
        assert!(refused(&[time(&[2.0, 1.0]), x(), z()]).contains("backwards"));
        assert!(refused(&[time(&[1.0, f64::INFINITY]), x(), z()]).contains("time_s"));
        assert!(refused(&[time(&[1.0, 1e300]), x(), z()]).contains("time_s"));
        assert!(refused(&[time(&[1.0, 2.0]), x(), ("z_mm", Values::Text(&["a", "b"]))]).contains("z_mm"));
        assert!(
            refused(&[time(&[1.0, 2.0]), x(), ("z_mm", Values::Real(&[1.0, 1e300]))]).contains("measured")
        );
        assert!(refused(&[time(&[1.0, 2.0]), x(), z(), ("z_m", Values::Real(&[1.0, 1.0]))]).contains("z_m"));
        assert!(refused(&[time(&[1.0, 2.0]), x(), z(), ("frame", Values::Long(&[-1, 2]))]).contains("frame"));
        assert!(
            refused(&[time(&[1.0, 2.0]), x(), z(), ("width", Values::Real(&[1.0, 1.0]))]).contains("width")
        );
        assert!(
            refused(&[time(&[]), ("x_mm", Values::Real(&[])), ("z_mm", Values::Real(&[]))]).contains("row")
        );
    }

    #[test]
    fn a_damaged_file_is_refused_or_read_and_never_more() {
        let profile = |k: i64| Profile {
            stamp_ns: k,
            frame: None,
            points: vec![trueline_dataset::ProfilePoint { x_m: 0.1, z_m: k as f64, intensity: None }; 40],
        };
        let bytes = profiles_parquet::bytes(&(0..20).map(profile).collect::<Vec<_>>()).unwrap();
        let path = Path::new("profiles.parquet");
        for end in 0..bytes.len() {
            assert!(profiles_parquet::read(path, bytes[..end].to_vec()).is_err(), "cut at {end}");
        }
        for at in 0..bytes.len() {
            for bit in 0..8 {
                let mut flipped = bytes.clone();
                flipped[at] ^= 1 << bit;
                if let Err(error) = profiles_parquet::read(path, flipped) {
                    assert!(error.to_string().contains("profiles.parquet"), "{error}");
                }
            }
        }
    }
}

/// Who has scanned anew and looks at the seam points of the scan before is told.
#[test]
fn profiles_that_are_newer_than_the_features_beside_them_are_mentioned() {
    let dir = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str, after_s: u64| {
        let file = std::fs::File::create(dir.path().join(name)).unwrap();
        std::io::Write::write_all(&mut &file, text.as_bytes()).unwrap();
        file.set_modified(std::time::UNIX_EPOCH + std::time::Duration::from_secs(1_000_000_000 + after_s))
            .unwrap();
    };
    write("sensor.toml", "kind = \"profiler\"\n", 0);
    write("robot.csv", "time_s,x_mm,y_mm,z_mm,qw,qx,qy,qz\n0,0,0,0,1,0,0,0\n1,1,0,0,1,0,0,0\n", 0);
    write("features.csv", "time_s,x_mm,z_mm\n0.5,1,100\n", 10);
    for (after_s, is_told) in [(5, false), (20, true)] {
        write("profiles.csv", "time_s,x_mm,z_mm\n0.5,1,100\n", after_s);
        let notes = trueline_dataset::folder::read_content(dir.path()).unwrap().notes;
        assert_eq!(notes.iter().any(|note| note.contains("is newer")), is_told, "{notes:?}");
        assert_eq!(notes.iter().any(|note| note.contains("is ignored")), !is_told, "{notes:?}");
    }
    // Files from `features` need no option.
    write("profiles.csv", "time_s,x_mm,z_mm\n0.5,1,100\n", 5);
    write("stripes.csv", "time_s,frame,plate,x1_mm,z1_mm,x2_mm,z2_mm,sigma_n_mm\n", 10);
    let notes = trueline_dataset::folder::read_content(dir.path()).map(|content| content.notes);
    assert!(notes.is_err() || notes.unwrap().is_empty());
}
