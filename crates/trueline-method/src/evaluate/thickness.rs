//! Thickness of flat patches of a cloud, and distance of the passes forth and back on them.
//!
//! A time offset error Δ moves the points of a pass at speed v by v Δ, and those of the pass back by the same amount in the other direction. A flat
//! patch then splits into two. The points are sorted into cubes of 5 mm, and only sums are kept.

use nalgebra::{Matrix3, SymmetricEigen, Vector3};
use std::collections::BTreeMap;

/// Edge of a cube, m.
const PATCH_M: f64 = 0.005;
/// Minimum points of each pass in a patch.
const FEWEST: f64 = 30.0;
/// The points of a patch form a surface if the spread of each pass along it is at least this multiple of that perpendicular to it …
const FLAT: f64 = 5.0;
/// … and at least this, m. One row of points is no surface.
const LEAST_SPREAD_M: f64 = 0.0003;
/// Speed below which the robot stands, m/s.
const STANDS_M_S: f64 = 1e-3;

/// Direction of a pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pass {
    /// Along the direction of the first motion.
    Forth,
    /// Against it.
    Back,
}

/// Sums over points: number, first and second moments about the middle of the cube.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    count: f64,
    first: Vector3<f64>,
    second: Matrix3<f64>,
}

impl Sums {
    fn add(&mut self, point: &Vector3<f64>) {
        self.count += 1.0;
        self.first += point;
        self.second += point * point.transpose();
    }

    fn and(&self, other: &Self) -> Self {
        Self {
            count: self.count + other.count,
            first: self.first + other.first,
            second: self.second + other.second,
        }
    }

    fn mean(&self) -> Vector3<f64> {
        self.first / self.count
    }

    fn covariance(&self) -> Matrix3<f64> {
        self.second / self.count - self.mean() * self.mean().transpose()
    }
}

/// The patches of a cloud so far.
#[derive(Clone, Debug, Default)]
pub struct Patches {
    cubes: BTreeMap<[i64; 3], [Sums; 2]>,
    forth: Option<Vector3<f64>>,
}

/// A patch seen from the side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatchSide {
    middle: Vector3<f64>,
    normal: Vector3<f64>,
    along: Vector3<f64>,
}

/// Half the length of the displayed patch, m.
const HALF_LENGTH_M: f64 = 0.01;
/// Half its width, m. It is small, so that a leaning patch does not look thicker.
const HALF_WIDTH_M: f64 = 0.0005;

impl PatchSide {
    /// Coordinates of a point in base along the scan and perpendicular to the patch, m. `None` for a point that is not on it.
    #[must_use]
    pub fn of(&self, point: &Vector3<f64>) -> Option<[f64; 2]> {
        let off = point - self.middle;
        let (along, square) = (off.dot(&self.along), off.dot(&self.normal));
        let aside = off.dot(&self.normal.cross(&self.along));
        let is_on_it =
            along.abs() <= HALF_LENGTH_M && aside.abs() <= HALF_WIDTH_M && square.abs() <= HALF_LENGTH_M;
        is_on_it.then_some([along, square])
    }
}

/// Results of one flat patch.
struct Flat {
    side: PatchSide,
    thickness_m: f64,
    apart_m: f64,
}

/// Results of the patches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thickness {
    /// Patches that are flat and have points of both passes.
    pub patches: usize,
    /// Median standard deviation of their points about a plane, m.
    pub thickness_m: f64,
    /// Median distance of the two passes perpendicular to the patch, m.
    pub apart_m: f64,
}

impl Patches {
    /// Direction of a velocity, m/s. `None` while the robot stands or turns off the path.
    pub fn pass(&mut self, velocity: &Vector3<f64>) -> Option<Pass> {
        if velocity.norm() < STANDS_M_S {
            return None;
        }
        let along = velocity.normalize().dot(self.forth.get_or_insert_with(|| velocity.normalize()));
        // Within 60° of it.
        match along {
            _ if along > 0.5 => Some(Pass::Forth),
            _ if along < -0.5 => Some(Pass::Back),
            _ => None,
        }
    }

    /// Adds a point in base, m.
    pub fn add(&mut self, pass: Pass, point: &Vector3<f64>) {
        let cube = [0, 1, 2].map(|axis| (point[axis] / PATCH_M).floor() as i64);
        let middle = Vector3::from(cube.map(|place| (place as f64 + 0.5) * PATCH_M));
        let sums = self.cubes.entry(cube).or_default();
        sums[usize::from(pass == Pass::Back)].add(&(point - middle));
    }

    /// All flat patches with points of both passes.
    fn flat(&self) -> impl Iterator<Item = Flat> + '_ {
        let both =
            self.cubes.iter().filter(|(_, [forth, back])| forth.count >= FEWEST && back.count >= FEWEST);
        both.filter_map(|(cube, [forth, back])| {
            let forth_along = self.forth?;
            // Passes that lie apart are two planes with a common direction.
            let count = forth.count + back.count;
            let within = (forth.covariance() * forth.count + back.covariance() * back.count) / count;
            let axes = SymmetricEigen::new(within);
            let mut order = [0, 1, 2];
            order.sort_by(|a, b| axes.eigenvalues[*a].total_cmp(&axes.eigenvalues[*b]));
            let [square, wide] = [0, 1].map(|k| axes.eigenvalues[order[k]].max(0.0));
            let normal: Vector3<f64> = axes.eigenvectors.column(order[0]).into_owned();
            let off = forth.mean() - back.mean();
            let of_all = normal.dot(&(forth.and(back).covariance() * normal)).max(0.0);
            let is_flat = wide > (FLAT * FLAT * square).max(LEAST_SPREAD_M * LEAST_SPREAD_M);
            let in_patch = (forth_along - normal * normal.dot(&forth_along)).try_normalize(1e-6);
            let along = in_patch.unwrap_or_else(|| axes.eigenvectors.column(order[2]).into_owned());
            let middle = Vector3::from(cube.map(|place| (place as f64 + 0.5) * PATCH_M));
            is_flat.then(|| Flat {
                side: PatchSide { middle: middle + forth.and(back).mean(), normal, along },
                thickness_m: of_all.sqrt(),
                apart_m: normal.dot(&off).abs(),
            })
        })
    }

    /// The flat patch with the median distance of the passes. `None` if there is none.
    #[must_use]
    pub fn typical(&self) -> Option<PatchSide> {
        let mut flat: Vec<Flat> = self.flat().collect();
        flat.sort_by(|a, b| a.apart_m.total_cmp(&b.apart_m));
        Some(flat.get(flat.len() / 2)?.side)
    }

    /// Results of the patches. `None` if no flat patch has points of both passes.
    #[must_use]
    pub fn thickness(&self) -> Option<Thickness> {
        let (mut thick, mut apart): (Vec<f64>, Vec<f64>) =
            self.flat().map(|flat| (flat.thickness_m, flat.apart_m)).unzip();
        if thick.is_empty() {
            return None;
        }
        let middle = |list: &mut Vec<f64>| {
            list.sort_by(f64::total_cmp);
            list[list.len() / 2]
        };
        Some(Thickness { patches: thick.len(), thickness_m: middle(&mut thick), apart_m: middle(&mut apart) })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    /// A sloping plate, z = x/2. Passes 0.2 mm apart along x are 0.2 mm · sin(atan ½) = 0.0894 mm apart perpendicular to it, and a cloud of both has
    /// half that thickness.
    #[test]
    fn passes_that_are_shifted_are_that_far_apart() {
        let mut patches = Patches::default();
        for k in 0..200 {
            for column in 0..100 {
                let (x, y) = (0.0002 * f64::from(k), 0.0003 * f64::from(column));
                for (velocity_m_s, shift_m) in [(0.1, 0.0001), (-0.1, -0.0001)] {
                    let pass = patches.pass(&(Vector3::x() * velocity_m_s)).unwrap();
                    patches.add(pass, &Vector3::new(x + shift_m, y, 0.5 * x));
                }
            }
        }
        let seen = patches.thickness().unwrap();
        let square_m = 0.0002 * (0.5_f64).atan().sin();
        assert!(seen.patches > 10);
        assert!((seen.apart_m / square_m - 1.0).abs() < 0.05, "{}", seen.apart_m);
        assert!((seen.thickness_m / (0.5 * square_m) - 1.0).abs() < 0.05, "{}", seen.thickness_m);
        // From the side the passes lie at half of that on both sides of the patch.
        let side = patches.typical().unwrap();
        let mut on_it = 0;
        for k in 0..200 {
            let x = 0.0002 * f64::from(k);
            for column in 0..100 {
                if let Some([_, off_m]) =
                    side.of(&Vector3::new(x + 0.0001, 0.0003 * f64::from(column), 0.5 * x))
                {
                    // If a cube cuts off part of a pass, its middle is off by a few percent.
                    assert!((off_m.abs() / (0.5 * square_m) - 1.0).abs() < 0.15, "{off_m}");
                    on_it += 1;
                }
            }
        }
        assert!(on_it > 20, "{on_it}");
    }

    #[test]
    fn one_pass_shows_nothing() {
        let mut patches = Patches::default();
        for k in 0..1000 {
            let pass = patches.pass(&Vector3::x()).unwrap();
            patches.add(pass, &Vector3::new(1e-6 * f64::from(k), 0.0, 0.0));
        }
        assert!(patches.pass(&Vector3::y()).is_none() && patches.pass(&Vector3::zeros()).is_none());
        assert_eq!(patches.thickness(), None);
        assert_eq!(patches.typical(), None);
    }
}
