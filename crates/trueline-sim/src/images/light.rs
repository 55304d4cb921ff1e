//! The light that comes to the camera along a ray: facets lit by the laser, directly and by one mirror.

use super::cross_section::{Facet, first_hit};
use super::look::Look;
use nalgebra::{Vector2, Vector3};
use trueline_geometry::{Line, Plane, Pose};

/// Beyond this many standard deviations the sheet is dark.
const SHEET_REACH: f64 = 5.0;
/// A hit nearer than this part of the way is where the ray began.
const BEYOND: f64 = 1e-9;

/// One instant of a scene, in the camera frame.
pub struct Light<'a> {
    facets: &'a [Facet],
    /// Stretches across the seam that scatter nothing, m.
    missing: &'a [[f64; 2]],
    look: &'a Look,
    seam: Vector3<f64>,
    along: Vector3<f64>,
    across: Vector3<f64>,
    away: Vector3<f64>,
    normal: Vector3<f64>,
    offset: f64,
    /// The laser, in the cross-section.
    emitter: Vector2<f64>,
    /// The facets as planes in the camera frame.
    planes: Vec<FacetPlane>,
}

/// A facet in the camera frame.
struct FacetPlane {
    /// Its unit normal, in the cross-section and in space.
    in_section: Vector2<f64>,
    normal: Vector3<f64>,
    /// A point on it, m.
    edge: Vector3<f64>,
}

impl<'a> Light<'a> {
    /// The scene of a joint along a seam, seen from a pose; the laser is beside the camera.
    #[must_use]
    pub fn new(
        (facets, missing, look): (&'a [Facet], &'a [[f64; 2]], &'a Look),
        (seam, approach): (&Line, &Vector3<f64>),
        base_from_camera: &Pose,
        sheet: &Plane,
    ) -> Self {
        let camera_from_base = base_from_camera.inverse();
        let along = seam.direction();
        let away = (approach - along * along.dot(approach)).normalize();
        let normal = sheet.normal().into_inner();
        // Point at which the sheet passes the camera: the nearest one with z = 0.
        let beside = normal.xy() * (sheet.offset() / normal.xy().norm_squared());
        let mut light = Self {
            facets,
            missing,
            look,
            seam: (camera_from_base * nalgebra::Point3::from(*seam.anchor())).coords,
            along: camera_from_base * along,
            across: camera_from_base * along.cross(&away),
            away: camera_from_base * away,
            normal,
            offset: sheet.offset(),
            emitter: Vector2::zeros(),
            planes: Vec::new(),
        };
        light.emitter = light.section(&Vector3::new(beside.x, beside.y, 0.0));
        light.planes = facets.iter().map(|facet| light.plane(facet)).collect();
        light
    }

    /// Brightness along a ray from the camera, in parts of full scale.
    #[must_use]
    pub fn along(&self, ray: &Vector3<f64>) -> f64 {
        let (eye, direction) = (self.section(&Vector3::zeros()), self.section_direction(ray));
        let Some(hit) = first_hit(self.facets, &eye, &direction, BEYOND) else { return 0.0 };
        let point = ray * hit.distance;
        let mut brightness = self.lit(&point, hit.facet);
        if self.look.mirror > 0.0 {
            brightness += self.seen_in_mirror(ray, &point, hit.facet) + self.lit_by_mirror(&point, hit.facet);
        }
        brightness
    }

    /// Stripe of the sheet on a facet, in the camera frame: its two ends, m. `None` where the seam runs along the
    /// sheet.
    #[must_use]
    pub(crate) fn stripe_on(&self, facet: &Facet) -> Option<[Vector3<f64>; 2]> {
        let toward = self.normal.dot(&self.along);
        (toward.abs() > 1e-6).then(|| {
            [facet.from, facet.to].map(|end| {
                let edge = self.seam + self.across * end.x + self.away * end.y;
                edge + self.along * ((self.offset - self.normal.dot(&edge)) / toward)
            })
        })
    }

    /// The point of a facet, at a place of the cross-section, that the sheet passes through; in the camera frame, m.
    #[must_use]
    pub fn on_sheet(&self, at: &Vector2<f64>) -> Option<Vector3<f64>> {
        let place = Facet { from: *at, to: *at, reflectance: 0.0 };
        self.stripe_on(&place).map(|[point, _]| point)
    }

    /// Light that a facet scatters at a point of it.
    fn lit(&self, point: &Vector3<f64>, facet: usize) -> f64 {
        let thickness = self.across_sheet(point);
        if thickness == 0.0 {
            return 0.0;
        }
        let (from, to) = (self.emitter, self.section(point));
        let way = to - from;
        // The point is lit if nothing stands between; its own facet is met at the end of the way.
        let first = first_hit(self.facets, &from, &way, BEYOND);
        if first.is_some_and(|hit| hit.facet != facet && hit.distance < 1.0 - 1e-9) {
            return 0.0;
        }
        thickness * self.scattered(&to, facet, &way)
    }

    /// The facet behind the mirror: the camera sees another facet's stripe in this one.
    fn seen_in_mirror(&self, ray: &Vector3<f64>, point: &Vector3<f64>, facet: usize) -> f64 {
        let normal = self.planes[facet].normal;
        let mirrored = ray - normal * (2.0 * normal.dot(ray));
        let (from, direction) = (self.section(point), self.section_direction(&mirrored));
        // A mirrored ray leaves its facet; rounding may let it meet that facet again at once.
        match first_hit(self.facets, &from, &direction, 1e-7) {
            Some(hit) if hit.facet != facet => {
                let seen = point + mirrored * hit.distance;
                let lit = self.lit(&seen, hit.facet);
                if lit == 0.0 { 0.0 } else { lit * self.mirrored(&self.section(&seen)) }
            }
            _ => 0.0,
        }
    }

    /// Laser light that reaches a point of a facet by way of a mirror.
    fn lit_by_mirror(&self, point: &Vector3<f64>, facet: usize) -> f64 {
        let mut brightness = 0.0;
        for mirror in (0..self.facets.len()).filter(|mirror| *mirror != facet) {
            let FacetPlane { normal, edge, .. } = &self.planes[mirror];
            let image = point - normal * (2.0 * normal.dot(&(point - edge)));
            let thickness = self.across_sheet(&image);
            if thickness == 0.0 {
                continue;
            }
            let (from, to) = (self.emitter, self.section(&image));
            let reached = first_hit(self.facets, &from, &(to - from), BEYOND);
            if reached.is_some_and(|hit| hit.facet == mirror && hit.distance < 1.0) {
                let here = self.section(point);
                brightness += thickness * self.mirrored(&here) * self.scattered(&here, facet, &(here - from));
            }
        }
        brightness
    }

    fn mirrored(&self, at: &Vector2<f64>) -> f64 {
        self.look.mirror * (-at.norm() / self.look.mirror_reach_m).exp()
    }

    /// The sheet's Gaussian thickness at a point.
    fn across_sheet(&self, point: &Vector3<f64>) -> f64 {
        let sigmas = (self.normal.dot(point) - self.offset) / self.look.laser_sigma_m;
        if sigmas.abs() > SHEET_REACH { 0.0 } else { (-0.5 * sigmas * sigmas).exp() }
    }

    /// A matt surface: as bright as the light falls steeply onto it.
    fn scattered(&self, at: &Vector2<f64>, facet: usize, way: &Vector2<f64>) -> f64 {
        if self.missing.iter().any(|[from, to]| (*from..*to).contains(&at.x)) {
            return 0.0;
        }
        let steepness = self.planes[facet].in_section.dot(&way.normalize()).abs();
        self.look.amplitude * self.facets[facet].reflectance * steepness
    }

    fn section(&self, point: &Vector3<f64>) -> Vector2<f64> {
        self.section_direction(&(point - self.seam))
    }

    fn section_direction(&self, direction: &Vector3<f64>) -> Vector2<f64> {
        Vector2::new(self.across.dot(direction), self.away.dot(direction))
    }

    fn plane(&self, facet: &Facet) -> FacetPlane {
        let in_section = facet.normal();
        FacetPlane {
            in_section,
            normal: self.across * in_section.x + self.away * in_section.y,
            edge: self.seam + self.across * facet.from.x + self.away * facet.from.y,
        }
    }
}
