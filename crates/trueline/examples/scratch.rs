//! scratch
use trueline::*;
use trueline_sim::*;
fn mc() {
    for preset in [Preset::Quick, Preset::TwoLines, Preset::Paper, Preset::Weak, Preset::Profiler] {
        let n = 100;
        let mut z2 = [0.0; 7];
        let mut nees = 0.0;
        let mut its = 0;
        for seed in 0..n {
            let s = preset.scenario();
            let r = simulate(&s, seed).unwrap();
            let truth = r.truth.as_ref().unwrap();
            let c = calibrate(&r, Some(&truth.parameters), &Config::default()).unwrap();
            its += c.iterations.len();
            let (dr, dt) = trueline_geometry::se3::difference_decoupled(
                &c.parameters.tool_from_camera,
                &truth.parameters.tool_from_camera,
            );
            let mut e = vec![c.parameters.time_offset_s - truth.parameters.time_offset_s];
            e.extend(dr.iter());
            e.extend(dt.iter());
            for k in 0..7 {
                if let Some(sg) = c.sigma(k) {
                    z2[k] += (e[k] / sg).powi(2);
                }
            }
            let ev = nalgebra::DVector::from_vec(e);
            let cov = c.covariance.view((0, 0), (7, 7)).into_owned();
            if let Some(i) = cov.try_inverse() {
                nees += ev.dot(&(i * &ev));
            }
        }
        println!(
            "{:12} rms z {:?} nees/7 {:.3} its {}",
            preset.name(),
            z2.map(|x| ((x / n as f64).sqrt() * 100.0).round() / 100.0),
            nees / 7.0 / n as f64,
            its / n as usize
        );
    }
}
fn main() {
    if std::env::args().any(|a| a == "mc") {
        return mc();
    }
    let noiseless = std::env::args().any(|a| a == "exact");
    let cell = std::env::args().any(|a| a == "cell");
    for preset in Preset::ALL {
        for seed in 0..if cell { 20 } else { 2 } {
            let mut s = preset.scenario();
            if cell {
                s = random_cell(&s, seed, 1.0);
            }
            if noiseless {
                s.disturbance = Default::default();
                s.timing.between = Between::Straight;
            }
            let r = simulate(&s, seed).unwrap();
            let t = std::time::Instant::now();
            let c = match calibrate(&r, None, &Config::default()) {
                Ok(c) => c,
                Err(e) => {
                    println!("{} {e}", preset.name());
                    continue;
                }
            };
            let el = t.elapsed().as_secs_f64();
            let truth = r.truth.as_ref().unwrap();
            let (dr, dt) = trueline_geometry::se3::difference_decoupled(
                &c.parameters.tool_from_camera,
                &truth.parameters.tool_from_camera,
            );
            let mut e = vec![c.parameters.time_offset_s - truth.parameters.time_offset_s];
            e.extend(dr.iter());
            e.extend(dt.iter());
            print!(
                "{:18} n={} {:.3}s rank {}/{} f={:.3} share={:.2} rms={:.4}mm px={:.3?} in/out {}/{} it={} | ",
                preset.name(),
                c.residuals.used,
                el,
                c.observability.rank,
                c.observability.size,
                c.noise_factor,
                c.covariance_model_share,
                c.residuals.rms_m * 1e3,
                c.residuals.rms_px,
                c.residuals.inliers,
                c.residuals.outliers,
                c.iterations.len()
            );
            for k in 0..7 {
                match c.sigma(k) {
                    Some(sig) => print!("{:.2e}({:.1}) ", e[k], e[k] / sig),
                    None => print!("- "),
                }
            }
            println!("cond {:.1e} {}", c.observability.condition, c.termination);
            if c.observability.rank < 9 || !cell {
                println!(
                    "  unseen {:?}",
                    c.observability.unseen.iter().map(|u| (u.group.name(), u.direction)).collect::<Vec<_>>()
                );
            }
            if false {
                println!("   {:?}", c.reasons);
            }
        }
    }
}
