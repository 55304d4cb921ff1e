use trueline_dataset::*;
use trueline_vision::{Detector, Joint, Lens, Picture};
fn main() {
    let d = std::env::args().nth(1).unwrap();
    let n: usize = std::env::args().nth(2).unwrap().parse().unwrap();
    let Sensor::CameraLaser { camera, laser_plane_in_camera } =
        folder::read_sensor(std::path::Path::new(&d)).unwrap()
    else {
        panic!()
    };
    let frames = images::read_index(std::path::Path::new(&d)).unwrap();
    let mut det = Detector::new(Lens::new(camera, laser_plane_in_camera));
    let ims: Vec<_> = frames.iter().take(12).map(|f| gray_png::read(&f.path, &mut vec![]).unwrap()).collect();
    let mut best = f64::MAX;
    let mut ok = 0;
    for r in 0..n {
        let t = std::time::Instant::now();
        ok = 0;
        for i in &ims {
            let Pixels::Eight(l) = &i.pixels else { panic!() };
            let p = Picture::new(i.width, i.height, l).unwrap();
            ok += det.seam(&p, Joint::Fillet).is_ok() as usize;
        }
        best = best.min(t.elapsed().as_secs_f64() * 1e3 / ims.len() as f64);
        let _ = r;
    }
    println!("{best:.3} ms per frame, {ok} of {}", ims.len());
}
