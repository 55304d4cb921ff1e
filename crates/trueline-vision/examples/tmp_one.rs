use trueline_dataset::*;
use trueline_vision::{Detector, Joint, Lens, Picture, corner};
fn main() {
    let d = std::env::args().nth(1).unwrap();
    let k: usize = std::env::args().nth(2).unwrap().parse().unwrap();
    let j = match std::env::args().nth(3).as_deref() {
        Some("lap") => Joint::Lap,
        Some("v") => Joint::VGroove,
        Some("butt") => Joint::Butt,
        _ => Joint::Fillet,
    };
    let Sensor::CameraLaser { camera, laser_plane_in_camera } =
        folder::read_sensor(std::path::Path::new(&d)).unwrap()
    else {
        panic!()
    };
    let frames = images::read_index(std::path::Path::new(&d)).unwrap();
    let mut det = Detector::new(Lens::new(camera, laser_plane_in_camera));
    let i = gray_png::read(&frames[k].path, &mut vec![]).unwrap();
    let Pixels::Eight(l) = &i.pixels else { panic!() };
    let p = Picture::new(i.width, i.height, l).unwrap();
    println!("{:?}", det.seam(&p, j));
    for x in det.pieces() {
        println!(
            "span {:?} n {} w {:.1} sigma {:.2} bright {:.0} at {:?} along {:?} runs {:?}",
            x.span(),
            x.marks.len(),
            x.weight(),
            x.sigma_px,
            x.brightness,
            x.line.point.as_slice(),
            x.line.along.as_slice(),
            x.runs().len()
        );
    }
    for x in corner::pairs(det.pieces(), det.lens()) {
        println!("{:?} score {:.2}", x, x.score());
    }
}
