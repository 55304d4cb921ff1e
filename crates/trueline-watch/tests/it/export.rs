//! The history as a Parquet file, read back by column names.
#![cfg(feature = "parquet")]

use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;
use trueline_watch::history_parquet;
use trueline_watch::store::{AlarmRow, HistoryRow};

fn row(id: i64, alarm: Option<AlarmRow>) -> HistoryRow {
    let mut estimates = vec![Some([1e-3, 1e-5]); 12];
    estimates[3] = None;
    HistoryRow {
        number: id,
        name: format!("weld, \"{id}\""),
        part: 1,
        watched_s: 1_700_000_000,
        used: 100,
        outliers: 2,
        noise_factor: 1.25,
        estimates,
        p_log10: vec![-1.0, -2.0, -3.0, -4.0],
        blind_to: vec!["seam".to_owned()],
        alarm,
    }
}

#[test]
fn every_number_is_there_and_what_is_not_known_is_null() {
    let alarm = AlarmRow {
        kind: "bracket".to_owned(),
        since: 3,
        p_log10: -7.5,
        is_within: true,
        text: Some("Seam points are 0.38 mm off.".to_owned()),
        seam_error: Some([3.8e-4, 1e-5]),
    };
    let bytes = history_parquet::bytes(&[row(7, None), row(8, Some(alarm))]).unwrap();
    let reader = SerializedFileReader::new(bytes::Bytes::from(bytes)).unwrap();
    let rows: Vec<_> = reader.get_row_iter(None).unwrap().map(Result::unwrap).collect();
    assert_eq!(rows.len(), 2);
    let value = |row: usize, name: &str| {
        rows[row].get_column_iter().find(|(own, _)| *own == name).map(|(_, field)| field.clone()).unwrap()
    };
    assert_eq!(value(0, "weld"), Field::Long(7));
    assert_eq!(value(0, "name"), Field::Str("weld, \"7\"".to_owned()));
    // SI inside, milliseconds in files.
    assert_eq!(
        (value(1, "change_time_offset_ms"), value(1, "sigma_time_offset_ms")),
        (Field::Double(1.0), Field::Double(0.01))
    );
    assert_eq!(value(0, "change_rotation_z_deg"), Field::Null);
    assert_eq!(value(0, "blind_to"), Field::Str("seam".to_owned()));
    assert_eq!(value(0, "p_log10_seam"), Field::Double(-4.0));
    assert_eq!((value(0, "alarm"), value(1, "alarm")), (Field::Null, Field::Str("bracket".to_owned())));
    assert_eq!(
        (value(1, "alarm_since_weld"), value(1, "alarm_p_log10")),
        (Field::Long(3), Field::Double(-7.5))
    );
    assert_eq!(
        (value(1, "state"), value(1, "alarm_seam_error_mm")),
        (Field::Str("changed-within-tolerance".to_owned()), Field::Double(0.38))
    );
    let empty = history_parquet::bytes(&[]).unwrap();
    assert_eq!(
        SerializedFileReader::new(bytes::Bytes::from(empty)).unwrap().metadata().file_metadata().num_rows(),
        0
    );
}
