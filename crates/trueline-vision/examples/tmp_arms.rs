use trueline_dataset::Pixels;
use trueline_sim::{Joint, Look, PictureScan, Preset, SensorModel};
use trueline_vision::corner::*;
use trueline_vision::stripe::*;
use trueline_vision::{Detector, Lens, Picture};
fn main() {
    let mut sc = Preset::Quick.scenario();
    sc.timing.duration_s = 20.0;
    sc.timing.frame_period_s = 0.1;
    let SensorModel::CameraLaser { camera, laser_plane_in_camera } = sc.cell.sensor.clone() else { panic!() };
    let lens = Lens::new(camera, laser_plane_in_camera);
    let clean = PictureScan::new(&sc, Joint::fillet(), Look::clean(), 1).unwrap();
    let looks = PictureScan::new(&sc, Joint::fillet(), Look::speckled(), 1).unwrap();
    let (mut rc, mut rs) = (clean.renderer(), looks.renderer());
    let mut det = Detector::new(lens.clone());
    let mut det2 = Detector::new(lens.clone());
    let mut meter = StripeMeter::default();
    let mut z = [0.0; 4];
    let mut n = 0.0;
    let mut g = vec![];
    for e in clean.exposures().iter().take(100) {
        let a = clean.draw(&mut rc, e).image;
        let b = looks.draw(&mut rs, e).image;
        let (Pixels::Eight(la), Pixels::Eight(lb)) = (&a.pixels, &b.pixels) else { panic!() };
        let pa = Picture::new(a.width, a.height, la).unwrap();
        let pb = Picture::new(a.width, a.height, lb).unwrap();
        if det.seam(&pa, trueline_vision::Joint::Fillet).is_err()
            || det2.seam(&pb, trueline_vision::Joint::Fillet).is_err()
        {
            continue;
        }
        let mut ps = pairs(det.pieces(), &lens);
        ps.sort_by(|a, b| b.score().total_cmp(&a.score()));
        let p = ps[0];
        for k in 0..2 {
            let span = [25.0, p.lengths[k].min(500.0)];
            let Some((fa, _)) = meter.fit(&p.arms[k], span, 2.5, (&pa, &lens)) else { continue };
            let Some((fb, t)) = meter.fit(&p.arms[k], span, 2.5, (&pb, &lens)) else { continue };
            // error at regression centre
            let err = fa.line.distance(&fb.line.point);
            let s = fb.regression.covariance.m11.sqrt();
            let serr = fa.line.along.perp(&fb.line.along).asin();
            let ss = fb.regression.covariance.m22.sqrt();
            z[0] += (err / s).powi(2);
            z[1] += (serr / ss).powi(2);
            z[2] += err * err;
            n += 1.0;
            // empirical gain: shift line by 0.4 px
            let sh = 0.2;
            let mut r = vec![];
            for q in [-sh, sh] {
                let l = fb.line.moved(q, 0.0);
                let st = fb.line.station(&p.arms[k].at(0.0));
                let sp = [st + span[0], st + span[1]];
                if let Some(f) = meter.fit_with(&l, sp, &t, (&pb, &lens)) {
                    r.push(f.regression.shift_px)
                }
            }
            if r.len() == 2 {
                g.push((r[0] - r[1]) / (2.0 * sh));
            }
            if n as usize % 20 == 1 {
                println!(
                    "err {err:.4} sigma {s:.4} n {} sig1 {:.3} gain {:.3} reach {:.1}",
                    fb.cuts,
                    fb.regression.sigma_px,
                    g.last().unwrap(),
                    t.reach_px
                );
            }
        }
    }
    println!(
        "chi2 offset {:.3} slope {:.3} rms {:.4}  gain mean {:.3}",
        z[0] / n,
        z[1] / n,
        (z[2] / n).sqrt(),
        g.iter().sum::<f64>() / g.len() as f64
    );
}
