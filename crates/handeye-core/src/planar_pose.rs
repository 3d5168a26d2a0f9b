//! The pose of a planar target in one image without a start: homography, then refinement, then its mirror image.
//!
//! Zhang, "A flexible new technique for camera calibration" (PAMI 2000), section 3.1, for the pose of a homography;
//! Schweighofer and Pinz, "Robust pose estimation from a planar target" (PAMI 2006), for the second minimum.

use nalgebra::{DMatrix, Matrix3, SMatrix, Vector2, Vector3};

use crate::camera::{Camera, Feature};
use crate::error::Error;
use crate::pose::{PoseFit, refine_pose};
use crate::se3::{Se3, nearest_rotation};

/// Fewest points of a homography.
pub const MIN_POINTS: usize = 4;

/// Poses of one view, the better first; the second minimum only where it exists and differs.
#[derive(Clone, Debug)]
pub struct PlanarPose {
    /// The pose with the smallest reprojection error.
    pub best: PoseFit,
    /// The other minimum of a plane seen from afar: the board mirrored about the line of sight.
    pub mirrored: Option<PoseFit>,
}

impl PlanarPose {
    /// How much worse the mirrored pose fits: its error over the best one's; infinite without a second minimum.
    ///
    /// Close to one the two cannot be told apart from this image.
    pub fn ambiguity_ratio(&self) -> f64 {
        self.mirrored.as_ref().map_or(f64::INFINITY, |m| m.rmse_px / self.best.rmse_px.max(f64::MIN_POSITIVE))
    }
}

/// Two poses closer than this (radians between rotations) are the same minimum.
const SAME_ROTATION_RAD: f64 = 1e-4;

/// Finds `T_camera_target` of a target in the plane `z = 0` from one view.
///
/// # Errors
/// [`Error::InvalidInput`] for fewer than [`MIN_POINTS`] points, points out of the plane, lengths that differ or
/// a pixel that is not finite; [`Error::Degenerate`] for points on a line; [`Error::Numerical`] where no pose in
/// front of the camera fits.
pub fn planar_pose(
    camera: &Camera,
    features: &[Feature],
    pixels: &[Vector2<f64>],
) -> Result<PlanarPose, Error> {
    if features.len() != pixels.len() {
        return Err(Error::invalid(format!("{} points but {} pixels", features.len(), pixels.len())));
    }
    if features.len() < MIN_POINTS {
        return Err(Error::invalid(format!(
            "{} points: a pose without a start needs at least {MIN_POINTS}",
            features.len()
        )));
    }
    let extent = features.iter().map(|f| f.position.norm()).fold(0.0, f64::max);
    if features.iter().any(|f| f.position.z.abs() > 1e-9 * extent.max(1e-3)) {
        return Err(Error::invalid("the points do not lie in the plane z = 0 of the target"));
    }
    let rays = rays(camera, pixels)?;
    let start = homography_pose(features, &rays)?;
    let first = refine_pose(camera, features, pixels, &start)?;
    let second = refine_pose(camera, features, pixels, &mirror(&first.t_camera_target, features))
        .ok()
        .filter(|other| rotation_between(other, &first) > SAME_ROTATION_RAD);
    Ok(match second {
        Some(second) if second.rmse_px < first.rmse_px => PlanarPose { best: second, mirrored: Some(first) },
        second => PlanarPose { best: first, mirrored: second },
    })
}

fn rotation_between(a: &PoseFit, b: &PoseFit) -> f64 {
    (a.t_camera_target.inverse() * b.t_camera_target).angle()
}

/// Points of the plane at unit depth.
fn rays(camera: &Camera, pixels: &[Vector2<f64>]) -> Result<Vec<Vector2<f64>>, Error> {
    pixels
        .iter()
        .enumerate()
        .map(|(i, pixel)| {
            camera
                .unproject(pixel)
                .filter(|ray| ray.z > 1e-3)
                .map(|ray| Vector2::new(ray.x / ray.z, ray.y / ray.z))
                .ok_or_else(|| {
                    Error::numerical(format!(
                        "point {i} at pixel ({:.1}, {:.1}) has no line of sight through this lens",
                        pixel.x, pixel.y
                    ))
                })
        })
        .collect()
}

/// Similarity that centres points and scales them to mean distance sqrt 2 (Hartley 1997).
fn normalising(points: impl Iterator<Item = Vector2<f64>> + Clone) -> Option<Matrix3<f64>> {
    let n = points.clone().count() as f64;
    let centre = points.clone().sum::<Vector2<f64>>() / n;
    let spread = points.map(|p| (p - centre).norm()).sum::<f64>() / n;
    if !(spread.is_finite() && spread > 0.0) {
        return None;
    }
    let s = std::f64::consts::SQRT_2 / spread;
    Some(Matrix3::new(s, 0.0, -s * centre.x, 0.0, s, -s * centre.y, 0.0, 0.0, 1.0))
}

fn homography_pose(features: &[Feature], rays: &[Vector2<f64>]) -> Result<Se3, Error> {
    let on_line = || Error::degenerate("the points of the view lie on one line: they determine no pose");
    let plane = features.iter().map(|f| Vector2::new(f.position.x, f.position.y));
    let from = normalising(plane.clone()).ok_or_else(on_line)?;
    let to = normalising(rays.iter().copied()).ok_or_else(on_line)?;
    // Of rows [p', 0, -u p'] and [0, p', -v p'] the sums of p p', and of that times u, v and u^2 + v^2.
    let mut sums = [Matrix3::zeros(); 4];
    for (p, u) in plane.zip(rays) {
        let p = from * Vector3::new(p.x, p.y, 1.0);
        let u = to * Vector3::new(u.x, u.y, 1.0);
        let outer = p * p.transpose();
        for (sum, factor) in sums.iter_mut().zip([1.0, -u.x, -u.y, u.x * u.x + u.y * u.y]) {
            *sum += outer * factor;
        }
    }
    let mut normal = SMatrix::<f64, 9, 9>::zeros();
    for (i, j, which) in [(0, 0, 0), (3, 3, 0), (0, 6, 1), (6, 0, 1), (3, 6, 2), (6, 3, 2), (6, 6, 3)] {
        normal.fixed_view_mut::<3, 3>(i, j).copy_from(&sums[which]);
    }
    let eigen = DMatrix::from_column_slice(9, 9, normal.as_slice()).symmetric_eigen();
    let mut order: Vec<usize> = (0..9).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
    // A line leaves a second null vector.
    if eigen.eigenvalues[order[1]] <= 1e-10 * eigen.eigenvalues[order[8]] {
        return Err(on_line());
    }
    let h = eigen.eigenvectors.column(order[0]);
    let h = Matrix3::new(h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], h[8]);
    let invert = |m: Matrix3<f64>| m.try_inverse().ok_or_else(on_line);
    let h = invert(to)? * h * from;
    let scale = 2.0 / (h.column(0).norm() + h.column(1).norm());
    let sign = if h[(2, 2)] < 0.0 { -scale } else { scale };
    let h = h * sign;
    let (r1, r2) = (h.column(0).into_owned(), h.column(1).into_owned());
    let rotation = nearest_rotation(&Matrix3::from_columns(&[r1, r2, r1.cross(&r2)]))
        .map_err(|_| Error::degenerate("the view's homography is no view of a plane"))?;
    Ok(Se3::new(rotation, h.column(2).into_owned()))
}

/// The other pose with the same weak-perspective image: mirrored in the plane across the line of sight.
fn mirror(pose: &Se3, features: &[Feature]) -> Se3 {
    let centre = features.iter().map(|f| f.position).sum::<Vector3<f64>>() / features.len() as f64;
    let seen = pose.act(&centre);
    let sight = seen / seen.norm();
    let reflection = Matrix3::identity() - sight * sight.transpose() * 2.0;
    let rotation = reflection * pose.rotation * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -1.0));
    Se3::new(rotation, seen - rotation * centre)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::least_squares::tests::Cell;
    use crate::testing::Random;

    #[test]
    fn finds_the_pose_of_every_view() {
        for seed in 0..20 {
            let cell = Cell::new(seed, 10);
            for motion in &cell.motions {
                let truth = cell.x * *motion * cell.y;
                let pixels: Vec<_> =
                    cell.features.iter().map(|f| cell.camera.observe(&truth, f).unwrap()).collect();
                let found = planar_pose(&cell.camera, &cell.features, &pixels).unwrap();
                let error = (found.best.t_camera_target.to_matrix() - truth.to_matrix()).amax();
                assert!(error < 1e-8, "seed {seed}: {error}");
                assert!(found.ambiguity_ratio() > 10.0);
            }
        }
    }

    #[test]
    fn tells_the_mirrored_pose_of_a_distant_board() {
        let cell = Cell::new(1, 1);
        let mut pose = cell.x * cell.motions[0] * cell.y;
        pose.translation *= 12.0;
        let mut random = Random::new(5);
        let pixels: Vec<_> = cell
            .features
            .iter()
            .map(|f| {
                cell.camera.observe(&pose, f).unwrap() + Vector2::new(random.normal(), random.normal()) * 0.1
            })
            .collect();
        let found = planar_pose(&cell.camera, &cell.features, &pixels).unwrap();
        assert!(found.mirrored.is_some());
        assert!(found.ambiguity_ratio() < 3.0, "{}", found.ambiguity_ratio());
    }

    #[test]
    fn refuses_lines_few_points_and_depth() {
        let cell = Cell::new(1, 1);
        let pose = cell.x * cell.motions[0] * cell.y;
        let look = |features: &[Feature]| {
            let pixels: Vec<_> = features.iter().map(|f| cell.camera.observe(&pose, f).unwrap()).collect();
            planar_pose(&cell.camera, features, &pixels)
        };
        assert!(matches!(look(&cell.features[..8]), Err(Error::Degenerate { .. })));
        assert!(matches!(look(&cell.features[..3]), Err(Error::InvalidInput { .. })));
        let mut bent = cell.features.clone();
        bent[20].position.z = 0.01;
        assert!(matches!(look(&bent), Err(Error::InvalidInput { .. })));
    }
}
