//! Seams from the plates in a cell's file: a fillet, an outside corner, a lap on either side, an edge, or nothing, with the
//! reason.

use nalgebra::Vector3;
use std::path::Path;
use trueline_dataset::{Error, sensor_toml};
use trueline_plan::{Cell, Joint, NoJoint, cell_toml};

/// The example's cell with a seam along x, and these plates.
fn parsed(plates: &str) -> Result<Cell, Error> {
    let file = Path::new("cell.toml");
    let text = cell_toml::EXAMPLE
        .replace("[1002.0, 54.5, 118.5]", "[1000.0, 80.0, 120.0]")
        .replace("[1298.0, 105.5, 121.5]", "[1300.0, 80.0, 120.0]");
    let sensor = sensor_toml::parse(file, cell_toml::EXAMPLE_SENSOR).unwrap();
    cell_toml::parse(file, &format!("{text}\n{plates}"), sensor)
}

fn joint(plates: &str) -> Result<Joint, NoJoint> {
    Joint::of(&parsed(plates).unwrap())
}

const LEFT: &str = "[[plates]]\nnormal = [0, -1, 1]\n";
const RIGHT: &str = "[[plates]]\nnormal = [0, 1, 1]\n";
const UP_LEFT: &str = "[[plates]]\nnormal = [0, 0, 1]\ntoward = [0.3, 1, -0.2]\n";
const UP_RIGHT: &str = "[[plates]]\nnormal = [0, 0, 2]\ntoward = [0, -1, 0]\n";

fn is_along(found: &Vector3<f64>, expected: [f64; 3]) -> bool {
    (found - Vector3::from(expected).normalize()).norm() < 1e-12
}

#[test]
fn plates_that_meet_reach_to_the_free_side_of_each_other_or_as_they_say() {
    let fillet = joint(&format!("{LEFT}{RIGHT}")).unwrap();
    assert_eq!((fillet.edge_on, fillet.seen), (None, [true; 2]));
    // The plate that faces −y rises to +y.
    assert!(is_along(&fillet.plates[0].outward, [0.0, 1.0, 1.0]));
    assert!(is_along(&fillet.plates[1].outward, [0.0, -1.0, 1.0]));
    // The faces of a block: each reaches away from the free side of the other.
    let corner = joint(&format!("{LEFT}toward = [0, -1, -1]\n{RIGHT}toward = [0, 1, -1]\n")).unwrap();
    assert_eq!(corner.edge_on, None);
    assert!(is_along(&corner.plates[0].outward, [0.0, -1.0, -1.0]));
    assert!(is_along(&corner.plates[1].outward, [0.0, 1.0, -1.0]));
}

#[test]
fn of_parallel_plates_the_one_at_the_seam_bears_the_edge() {
    for (plates, on) in [
        (format!("{UP_LEFT}{UP_RIGHT}below_mm = 3\n"), 0),
        (format!("{UP_LEFT}below_mm = 3\n{UP_RIGHT}"), 1),
        (format!("{UP_LEFT}{UP_RIGHT}point_mm = [900, 0, 117]\n"), 0),
    ] {
        let lap = joint(&plates).unwrap();
        assert_eq!((lap.edge_on, lap.seen), (Some(on), [true; 2]), "{plates}");
        assert!(is_along(&lap.plates[0].outward, [0.0, 1.0, 0.0]));
        assert!(is_along(&lap.plates[1].outward, [0.0, -1.0, 0.0]));
        assert!(lap.plates[on].above_m.abs() < 1e-15 && (lap.plates[1 - on].above_m + 3e-3).abs() < 1e-12);
    }
    let edge = joint(UP_RIGHT).unwrap();
    assert_eq!((edge.edge_on, edge.seen), (Some(0), [true, false]));
    assert!(is_along(&edge.plates[0].outward, [0.0, -1.0, 0.0]));
}

#[test]
fn plates_that_make_no_joint_say_why() {
    for (plates, why) in [
        (String::new(), NoJoint::Unnamed),
        (format!("{LEFT}{RIGHT}{UP_LEFT}"), NoJoint::Unnamed),
        // One plate that only keeps spheres off says nothing of its end, as two level ones.
        ("[[plates]]\nnormal = [0, 0, 1]\n".to_owned(), NoJoint::NoSide),
        (format!("{UP_LEFT}[[plates]]\nnormal = [0, 0, 1]\nbelow_mm = 3\n"), NoJoint::NoSide),
        (format!("{UP_LEFT}{UP_LEFT}below_mm = 3\n"), NoJoint::SameSide),
        (format!("{UP_LEFT}{UP_RIGHT}"), NoJoint::NoStep),
        (format!("{LEFT}toward = [0, -1, -1]\n{RIGHT}"), NoJoint::OneSide),
        (format!("{LEFT}{RIGHT}toward = [0, 1, -1]\n"), NoJoint::OneSide),
    ] {
        assert_eq!(joint(&plates).unwrap_err(), why, "{plates}");
    }
    // The sensor looks down; a normal into the metal has been drawn the wrong way round.
    for (plates, plate, turned_deg) in [
        ("[[plates]]\nnormal = [0, 1, -1]\n[[plates]]\nnormal = [0, -1, -1]\n".to_owned(), 1, 135.0),
        (format!("{LEFT}[[plates]]\nnormal = [0, -1, -1]\n"), 2, 135.0),
        ("[[plates]]\nnormal = [0, 0, -1]\ntoward = [0, 1, 0]\n".to_owned(), 1, 180.0),
    ] {
        let Err(NoJoint::FacesAway { plate: found, turned_deg: angle }) = joint(&plates) else {
            panic!("{plates}")
        };
        assert_eq!(found, plate, "{plates}");
        assert!((angle - turned_deg).abs() < 0.1, "{angle}");
    }
    // One that the sensor looks along is another matter.
    assert!(joint(&format!("{LEFT}[[plates]]\nnormal = [0, 1, 0]\n")).is_ok());
    // A plate that says on which side of the seam it lies must be at it.
    for plates in [
        format!("{UP_LEFT}point_mm = [1000, 0, 160]\n"),
        format!("{LEFT}{RIGHT}toward = [0, -1, 1]\npoint_mm = [1000, 0, 290]\n"),
        format!("{UP_LEFT}below_mm = 30\n{UP_RIGHT}below_mm = 33\n"),
    ] {
        let Err(NoJoint::OffSeam { off_m }) = joint(&plates) else { panic!("{plates}") };
        assert!((0.02..0.2).contains(&off_m));
    }
    for (plates, key) in [
        ("[[plates]]\nnormal = [0, 0, 1]\ntoward = [1, 0.01, 0]\n", "plates.toward"),
        ("[[plates]]\nnormal = [0, 0, 1]\ntoward = [0, 0.01, 1]\n", "plates.toward"),
        ("[[plates]]\nnormal = [0, 0, 1]\ntoward = [0, 0, 0]\n", "plates.toward"),
        ("[[plates]]\nnormal = [0, 0, 1]\nbelow_mm = -3\n", "plates.below_mm"),
        ("[[plates]]\nnormal = [0, 0, 1]\nbelow_mm = 3\npoint_mm = [0, 0, 0]\n", "plates.below_mm"),
        // Of a fillet, and of a plate alone, nothing lies below.
        (
            "[[plates]]\nnormal = [0, -1, 1]\nbelow_mm = 4\n[[plates]]\nnormal = [0, 1, 1]\n",
            "plates.below_mm",
        ),
        ("[[plates]]\nnormal = [0, 0, 1]\ntoward = [0, 1, 0]\nbelow_mm = 5\n", "plates.below_mm"),
    ] {
        let message = parsed(plates).unwrap_err().to_string();
        assert!(message.contains(key), "{plates}: {message}");
    }
}
