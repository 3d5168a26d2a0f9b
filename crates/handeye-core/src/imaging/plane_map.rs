//! Where the plane of a board is seen: a homography, and what a lens adds to it.

use nalgebra::{Matrix2, Matrix3, SMatrix, SVector, Vector2, Vector3};

/// Points from which a lens is told from a homography.
const FEWEST_FOR_LENS: usize = 20;
/// Steps of Gauss and Newton after the algebraic answer.
const STEPS: usize = 3;
/// Powers of two coordinates up to the third.
pub(super) const POWERS: usize = 10;

/// A map from the plane of a target, in metres, to pixels.
#[derive(Clone, Debug)]
pub struct PlaneMap {
    pub(super) homography: Matrix3<f64>,
    /// Middle and inverse half sides of the box of places from which the rest is known.
    pub(super) middle: Vector2<f64>,
    pub(super) per_half: Vector2<f64>,
    /// Pixels for each power of places in this box.
    pub(super) coefficients: SMatrix<f64, POWERS, 2>,
}

impl PlaneMap {
    /// The map that fits places and pixels best, least squares; `None` where there is none.
    pub fn fitted(plane: &[Vector2<f64>], pixels: &[Vector2<f64>]) -> Option<Self> {
        if plane.len() < 4 || plane.len() != pixels.len() {
            return None;
        }
        let homography = homography(plane, pixels)?;
        let (low, high) = (
            plane.iter().copied().reduce(|a, b| a.inf(&b))?,
            plane.iter().copied().reduce(|a, b| a.sup(&b))?,
        );
        let mut map = Self {
            homography,
            middle: (low + high) / 2.0,
            per_half: Vector2::zeros(),
            coefficients: SMatrix::zeros(),
        };
        let half = (high - low) / 2.0;
        if plane.len() < FEWEST_FOR_LENS || half.min() <= 0.0 {
            return Some(map);
        }
        map.per_half = half.map(|x| 1.0 / x);
        let mut normal = SMatrix::<f64, POWERS, POWERS>::identity() * (1e-6 * plane.len() as f64);
        let mut right = SMatrix::<f64, POWERS, 2>::zeros();
        for (place, pixel) in plane.iter().zip(pixels) {
            let powers = map.powers(place);
            normal += powers * powers.transpose();
            right += powers * (pixel - through(&homography, place)).transpose();
        }
        map.coefficients = normal.cholesky()?.solve(&right);
        map.coefficients.iter().all(|x| x.is_finite()).then_some(map)
    }

    /// Where a place is in the image.
    pub fn pixel(&self, place: &Vector2<f64>) -> Vector2<f64> {
        through(&self.homography, place) + self.coefficients.tr_mul(&self.powers(place))
    }

    /// Pixels per metre along each axis (rows) at a place, from both sides of it at a distance in metres.
    pub fn steps(&self, place: &Vector2<f64>, half: f64) -> Matrix2<f64> {
        steps(|place| self.pixel(place), place, half)
    }

    fn powers(&self, place: &Vector2<f64>) -> SVector<f64, POWERS> {
        let [x, y]: [f64; 2] = (place - self.middle).component_mul(&self.per_half).into();
        SVector::from([1.0, x, x * x, x * x * x, y, x * y, x * x * y, y * y, x * y * y, y * y * y])
    }
}

/// Differences of a map per metre along each axis (rows), from both sides of a place.
pub(super) fn steps(
    map: impl Fn(&Vector2<f64>) -> Vector2<f64>,
    place: &Vector2<f64>,
    half: f64,
) -> Matrix2<f64> {
    let along =
        |axis: Vector2<f64>| (map(&(place + half * axis)) - map(&(place - half * axis))) / (2.0 * half);
    let (x, y) = (along(Vector2::x()), along(Vector2::y()));
    Matrix2::new(x[0], x[1], y[0], y[1])
}

/// Where a homography brings a place.
pub(super) fn through(homography: &Matrix3<f64>, place: &Vector2<f64>) -> Vector2<f64> {
    let image = homography * Vector3::new(place[0], place[1], 1.0);
    image.xy() / image[2]
}

/// The homography that fits best; first by the equations without their denominators, which are linear, then by
/// distances in the image.
fn homography(plane: &[Vector2<f64>], pixels: &[Vector2<f64>]) -> Option<Matrix3<f64>> {
    let (from, to) = (centring(plane)?, centring(pixels)?);
    let mut h = SVector::<f64, 8>::zeros();
    for step in 0..=STEPS {
        let mut normal = SMatrix::<f64, 8, 8>::identity() * 1e-12;
        let mut right = SVector::<f64, 8>::zeros();
        for (place, pixel) in plane.iter().zip(pixels) {
            let ([x, y], seen) = (through(&from, place).into(), through(&to, pixel));
            let (mut depth, mut expected, mut known) = (1.0, seen, Vector2::zeros());
            if step > 0 {
                depth = h[6] * x + h[7] * y + 1.0;
                expected = Vector2::new(h[0] * x + h[1] * y + h[2], h[3] * x + h[4] * y + h[5]) / depth;
                known = expected;
            }
            let rows = [
                [x, y, 1.0, 0.0, 0.0, 0.0, -expected[0] * x, -expected[0] * y],
                [0.0, 0.0, 0.0, x, y, 1.0, -expected[1] * x, -expected[1] * y],
            ];
            for (row, residual) in rows.into_iter().zip([seen[0] - known[0], seen[1] - known[1]]) {
                let row = SVector::from(row) / depth;
                normal += row * row.transpose();
                right += row * residual;
            }
        }
        h += normal.cholesky()?.solve(&right);
    }
    let centred = Matrix3::new(h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1.0);
    let all = to.try_inverse()? * centred * from;
    all.iter().all(|x| x.is_finite()).then_some(all)
}

/// The similarity that brings points about the origin, and to a size of one.
fn centring(points: &[Vector2<f64>]) -> Option<Matrix3<f64>> {
    let middle = points.iter().sum::<Vector2<f64>>() / points.len() as f64;
    let size = points.iter().map(|point| (point - middle).amax()).fold(0.0, f64::max);
    (size > 0.0 && size.is_finite()).then(|| {
        Matrix3::new(1.0 / size, 0.0, -middle[0] / size, 0.0, 1.0 / size, -middle[1] / size, 0.0, 0.0, 1.0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn places() -> Vec<Vector2<f64>> {
        (0..30).map(|i| Vector2::new(f64::from(i % 6), f64::from(i / 6)) * 0.03).collect()
    }

    #[test]
    fn homographies_are_recovered() {
        let truth = Matrix3::new(5000.0, 300.0, 200.0, -400.0, 4500.0, 150.0, 0.5, -0.8, 1.0);
        for count in [4, 30] {
            let places: Vec<_> =
                [0, 5, 24, 29].into_iter().chain(0..30).take(count).map(|i| places()[i]).collect();
            let pixels: Vec<_> = places.iter().map(|place| through(&truth, place)).collect();
            let map = PlaneMap::fitted(&places, &pixels).unwrap();
            for (place, pixel) in places.iter().zip(&pixels) {
                assert!((map.pixel(place) - pixel).norm() < 1e-6);
            }
        }
    }

    #[test]
    fn a_lens_is_told_from_a_homography() {
        let bend = |pixel: Vector2<f64>| {
            let off = (pixel - Vector2::new(600.0, 400.0)) / 1000.0;
            pixel - off * off.norm_squared() * 20.0
        };
        let truth = Matrix3::new(5000.0, 300.0, 200.0, -400.0, 4500.0, 150.0, 0.5, -0.8, 1.0);
        let pixels: Vec<_> = places().iter().map(|place| bend(through(&truth, place))).collect();
        let map = PlaneMap::fitted(&places(), &pixels).unwrap();
        let straight = homography(&places(), &pixels).unwrap();
        let furthest = |image: &dyn Fn(&Vector2<f64>) -> Vector2<f64>| {
            places()
                .iter()
                .zip(&pixels)
                .map(|(place, pixel)| (image(place) - pixel).norm())
                .fold(0.0, f64::max)
        };
        let (bent, straight) =
            (furthest(&|place| map.pixel(place)), furthest(&|place| through(&straight, place)));
        assert!(straight > 0.3 && bent < 0.2 * straight, "{bent} {straight}");
        let at = Vector2::new(0.07, 0.05);
        let expected =
            (map.pixel(&(at + Vector2::x() * 1e-3)) - map.pixel(&(at - Vector2::x() * 1e-3))) / 2e-3;
        assert!((map.steps(&at, 1e-3).row(0).transpose() - expected).norm() < 1e-6);
    }

    #[test]
    fn nonsense_has_no_map() {
        let places = places();
        for pixel in [f64::NAN, 0.0, 1e300] {
            let pixels: Vec<_> = places.iter().map(|place| place * pixel).collect();
            assert!(
                PlaneMap::fitted(&places, &pixels)
                    .is_none_or(|map| pixel != 0.0 && map.homography.iter().all(|x| x.is_finite()))
            );
        }
        assert!(PlaneMap::fitted(&places[..3], &places[..3]).is_none());
    }
}
