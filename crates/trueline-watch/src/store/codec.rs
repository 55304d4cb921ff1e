//! Numbers as bytes: little-endian doubles, counts first.

use crate::detect::Scatter;
use crate::innovation::WeldStatistic;
use crate::quadratic::Quadratic;
use crate::reference::Part;
use nalgebra::{DMatrix, DVector, Quaternion, UnitQuaternion, UnitVector3, Vector3};
use trueline_geometry::{Line, Pose, se3};

fn bytes(numbers: impl IntoIterator<Item = f64>) -> Vec<u8> {
    numbers.into_iter().flat_map(f64::to_le_bytes).collect()
}

fn numbers(bytes: &[u8]) -> Option<Vec<f64>> {
    let (chunks, rest) = bytes.as_chunks::<8>();
    rest.is_empty().then(|| chunks.iter().map(|chunk| f64::from_le_bytes(*chunk)).collect())
}

/// The upper triangle, row by row.
fn triangle(matrix: &DMatrix<f64>) -> impl Iterator<Item = f64> + '_ {
    (0..matrix.nrows()).flat_map(move |i| (i..matrix.nrows()).map(move |j| matrix[(i, j)]))
}

fn symmetric(size: usize, triangle: &[f64]) -> DMatrix<f64> {
    let mut matrix = DMatrix::zeros(size, size);
    let places = (0..size).flat_map(|i| (i..size).map(move |j| (i, j)));
    for ((i, j), value) in places.zip(triangle) {
        matrix[(i, j)] = *value;
        matrix[(j, i)] = *value;
    }
    matrix
}

pub(super) fn statistic_bytes(of: &WeldStatistic) -> Vec<u8> {
    let head =
        [of.evidence.size() as f64, of.used as f64, of.outliers as f64, of.noise_factor, of.correlation];
    let pose = of.base_from_part.iter().flat_map(pose_numbers);
    bytes(
        head.into_iter()
            .chain(of.evidence.vector.iter().copied())
            .chain(triangle(&of.evidence.matrix))
            .chain(pose),
    )
}

/// Number of [`pose_numbers`].
const POSE: usize = 7;

fn pose_numbers(pose: &Pose) -> [f64; POSE] {
    let (p, q) = (pose.translation.vector, pose.rotation.quaternion());
    [p.x, p.y, p.z, q.w, q.i, q.j, q.k]
}

fn pose([x, y, z, w, i, j, k]: &[f64; POSE]) -> Pose {
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(*w, *i, *j, *k));
    se3::from_parts(rotation, Vector3::new(*x, *y, *z))
}

pub(super) fn statistic(from: &[u8]) -> Option<WeldStatistic> {
    let all = numbers(from)?;
    let (&[size, used, outliers, noise_factor, correlation], rest) = all.split_first_chunk::<5>()?;
    let n = size as usize;
    if n > MOST || rest.len() < n + n * (n + 1) / 2 {
        return None;
    }
    let (vector, rest) = rest.split_at(n);
    let (matrix, rest) = rest.split_at(n * (n + 1) / 2);
    // Statistics of welds without an axis under the part end here.
    let base_from_part = match rest {
        [] => None,
        rest => Some(pose(rest.try_into().ok()?)),
    };
    Some(WeldStatistic {
        evidence: Quadratic { matrix: symmetric(n, matrix), vector: DVector::from_column_slice(vector) },
        used: used as usize,
        outliers: outliers as usize,
        noise_factor,
        correlation,
        base_from_part,
    })
}

/// No part has two hundred seams.
const MOST: usize = 1000;

pub(super) fn scatter_bytes(of: &Scatter) -> Vec<u8> {
    let head = [of.covariance.nrows() as f64, of.pieces as f64];
    bytes(head.into_iter().chain(of.dispersion).chain(triangle(&of.covariance)))
}

pub(super) fn scatter(from: &[u8]) -> Option<Scatter> {
    let all = numbers(from)?;
    let (&[size, pieces, d0, d1, d2, d3], rest) = all.split_first_chunk::<6>()?;
    let n = size as usize;
    if n > MOST || rest.len() != n * (n + 1) / 2 {
        return None;
    }
    Some(Scatter { covariance: symmetric(n, rest), pieces: pieces as usize, dispersion: [d0, d1, d2, d3] })
}

pub(super) fn part_bytes(of: &Part) -> Vec<u8> {
    let line = |line: &Line| {
        let (point, direction) = (*line.anchor(), line.direction());
        [point.x, point.y, point.z, direction.x, direction.y, direction.z]
    };
    bytes(of.lines.iter().flat_map(line))
}

pub(super) fn part(from: &[u8]) -> Option<Part> {
    let all = numbers(from)?;
    let (seams, rest) = all.as_chunks::<6>();
    let line = |[x, y, z, dx, dy, dz]: &[f64; 6]| {
        let direction = UnitVector3::try_new(Vector3::new(*dx, *dy, *dz), 1e-6)?;
        Some(Line::new(Vector3::new(*x, *y, *z), &direction))
    };
    if !rest.is_empty() {
        return None;
    }
    Some(Part { lines: seams.iter().map(line).collect::<Option<_>>()? })
}

/// Estimates and their standard deviations; NaN if there is none.
pub(super) fn pairs_bytes(of: &[Option<[f64; 2]>]) -> Vec<u8> {
    bytes(of.iter().flat_map(|pair| pair.unwrap_or([f64::NAN; 2])))
}

pub(super) fn pairs(from: &[u8]) -> Option<Vec<Option<[f64; 2]>>> {
    let all = numbers(from)?;
    let (pairs, rest) = all.as_chunks::<2>();
    let known = |pair: &[f64; 2]| pair.iter().all(|x| x.is_finite()).then_some(*pair);
    rest.is_empty().then(|| pairs.iter().map(known).collect())
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_and_half_of_it_is_not() {
        let n = 16;
        let matrix = DMatrix::from_fn(n, n, |i, j| 1.0 / (1.0 + (i + j) as f64));
        let vector = DVector::from_fn(n, |i, _| i as f64);
        let evidence = Quadratic { matrix: matrix.clone(), vector };
        let turned = UnitQuaternion::from_scaled_axis(Vector3::new(0.1, -0.2, 0.3));
        let on_table = WeldStatistic {
            evidence,
            used: 660,
            outliers: 3,
            noise_factor: 1.1,
            correlation: -0.02,
            base_from_part: Some(se3::from_parts(turned, Vector3::new(1.0, 2.0, 3.0))),
        };
        let read = statistic(&statistic_bytes(&on_table)).unwrap();
        let [one, other] = [&read, &on_table].map(|of| of.base_from_part.unwrap());
        assert!((one.inverse() * other).to_homogeneous().is_identity(1e-15));
        let known = WeldStatistic { base_from_part: None, ..on_table };
        let bytes = statistic_bytes(&known);
        assert_eq!(statistic(&bytes).unwrap(), known);
        assert!(statistic(&bytes[..bytes.len() - 8]).is_none());
        assert!(statistic(&bytes[..bytes.len() - 3]).is_none());
        let learnt = Scatter { covariance: matrix, pieces: 30, dispersion: [1.0, 1.5, 1.0, 1.0] };
        assert_eq!(scatter(&scatter_bytes(&learnt)).unwrap(), learnt);
        let estimates = vec![Some([1.0, 2.0]), None];
        assert_eq!(pairs(&pairs_bytes(&estimates)).unwrap(), estimates);
    }
}
