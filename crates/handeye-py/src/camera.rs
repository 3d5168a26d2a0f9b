//! Projection and its inverse, batched.

use crate::call::CallCore;
use handeye_core::camera::{Camera, Feature, Lens, ParameterJacobian, Projection};
use handeye_core::interrupt::checked;
use handeye_core::pose;
use nalgebra::{Matrix2x3, SVector, Vector2, Vector3};
use numpy::{IntoPyArray, PyArray1, PyArrayDyn};
use pyo3::prelude::*;

use crate::convert::{self, Array};
use crate::errors::{invalid, to_python};

/// Registers the functions of this file.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(lenses, module)?)?;
    module.add_function(wrap_pyfunction!(project, module)?)?;
    module.add_function(wrap_pyfunction!(project_jacobians, module)?)?;
    module.add_function(wrap_pyfunction!(unproject, module)?)?;
    module.add_function(wrap_pyfunction!(project_features, module)?)?;
    module.add_function(wrap_pyfunction!(refine_pose, module)?)?;
    module.add_function(wrap_pyfunction!(camera_shift, module)?)
}

type Floats<'py> = Bound<'py, PyArrayDyn<f64>>;
type Flags<'py> = Bound<'py, PyArray1<bool>>;

const NAN_PIXEL: Vector2<f64> = Vector2::new(f64::NAN, f64::NAN);

/// The camera of a lens name and its parameters.
pub fn camera(py: Python<'_>, lens: &str, parameters: &Array<'_>) -> PyResult<Camera> {
    let parameters = convert::scalars(py, "parameters", parameters)?;
    Lens::from_name(lens)
        .and_then(|lens| Camera::new(lens, &parameters))
        .map_err(|error| to_python(py, error))
}

/// Features from points `(N, 3)` and radii `(N,)`; an error names the index.
pub fn features(py: Python<'_>, points: &Array<'_>, radii: &Array<'_>) -> PyResult<Vec<Feature>> {
    let points = convert::rows::<3>(py, "points", points)?;
    let radii = convert::entries(py, "radii", radii)?;
    let count = points.len() / 3;
    if count != radii.len() {
        return Err(invalid(py, &format!("{count} points but {} radii", radii.len())));
    }
    let all = || points.chunks_exact(3).zip(&*radii).map(|(p, r)| (Vector3::new(p[0], p[1], p[2]), *r));
    // Without a way out in the middle these go many at a time.
    let finite = points.iter().fold(true, |fine, x| fine & x.is_finite());
    if finite & radii.iter().fold(true, |fine, r| fine & (0.0..f64::INFINITY).contains(r)) {
        return Ok(all().map(|(position, radius)| Feature { position, radius }).collect());
    }
    // One by one, to say which.
    let one = |(i, (position, radius))| {
        Feature::new(position, radius).map_err(|error| invalid(py, &format!("feature {i}: {error}")))
    };
    all().enumerate().map(one).collect()
}

#[pyfunction]
fn lenses() -> Vec<(&'static str, Vec<&'static str>)> {
    Lens::ALL.iter().map(|lens| (lens.name(), lens.coefficients().to_vec())).collect()
}

#[pyfunction]
fn project<'py>(
    py: Python<'py>,
    lens: &str,
    parameters: Array<'py>,
    points_camera: Array<'py>,
) -> PyResult<(Floats<'py>, Flags<'py>)> {
    let camera = camera(py, lens, &parameters)?;
    let points = convert::vectors::<3>(py, "points_camera", &points_camera)?;
    let pixels: Vec<_> = py.core(|| checked(&points).map(|p| camera.project(p)).collect())?;
    Ok(optional_out(py, &pixels, NAN_PIXEL))
}

#[pyfunction]
fn project_jacobians<'py>(
    py: Python<'py>,
    lens: &str,
    parameters: Array<'py>,
    points_camera: Array<'py>,
) -> PyResult<(Floats<'py>, Floats<'py>, Floats<'py>, Flags<'py>)> {
    let camera = camera(py, lens, &parameters)?;
    let points = convert::vectors::<3>(py, "points_camera", &points_camera)?;
    let projections: Vec<_> =
        py.core(|| checked(&points).map(|p| camera.project_with_derivatives(p)).collect())?;
    let unseen = Projection {
        pixel: NAN_PIXEL,
        d_point: Matrix2x3::repeat(f64::NAN),
        d_parameters: ParameterJacobian::repeat(f64::NAN),
    };
    let valid: Vec<bool> = projections.iter().map(Option::is_some).collect();
    let all: Vec<Projection> = projections.into_iter().map(|p| p.unwrap_or(unseen)).collect();
    let pixels: Vec<_> = all.iter().map(|p| p.pixel).collect();
    let d_point: Vec<_> = all.iter().map(|p| p.d_point).collect();
    let d_parameters: Vec<_> = all.iter().map(|p| p.d_parameters).collect();
    Ok((
        convert::vectors_out(py, &pixels),
        convert::matrices_out(py, &d_point),
        convert::matrices_columns_out(py, &d_parameters, camera.lens.parameter_count()),
        valid.into_pyarray(py),
    ))
}

#[pyfunction]
fn unproject<'py>(
    py: Python<'py>,
    lens: &str,
    parameters: Array<'py>,
    uv: Array<'py>,
) -> PyResult<(Floats<'py>, Flags<'py>)> {
    let camera = camera(py, lens, &parameters)?;
    let pixels = convert::vectors::<2>(py, "uv", &uv)?;
    let rays: Vec<_> = py.core(|| checked(&pixels).map(|p| camera.unproject(p)).collect())?;
    Ok(optional_out(py, &rays, Vector3::repeat(f64::NAN)))
}

#[pyfunction]
#[expect(non_snake_case, reason = "the name in Python")]
fn project_features<'py>(
    py: Python<'py>,
    lens: &str,
    parameters: Array<'py>,
    T_camera_target: Array<'py>,
    points: Array<'py>,
    radii: Array<'py>,
) -> PyResult<(Floats<'py>, Flags<'py>)> {
    let camera = camera(py, lens, &parameters)?;
    let transform = convert::transform(py, "T_camera_target", &T_camera_target)?;
    let features = features(py, &points, &radii)?;
    let pixels: Vec<_> = py.core(|| checked(&features).map(|f| camera.observe(&transform, f)).collect())?;
    Ok(optional_out(py, &pixels, NAN_PIXEL))
}

#[pyfunction]
#[expect(non_snake_case, reason = "the name in Python")]
fn refine_pose<'py>(
    py: Python<'py>,
    lens: &str,
    parameters: Array<'py>,
    points: Array<'py>,
    radii: Array<'py>,
    pixels: Array<'py>,
    T_camera_target: Array<'py>,
) -> PyResult<(Floats<'py>, f64, Floats<'py>)> {
    let camera = camera(py, lens, &parameters)?;
    let features = features(py, &points, &radii)?;
    let pixels = convert::vectors::<2>(py, "pixels", &pixels)?;
    let start = convert::transform(py, "T_camera_target", &T_camera_target)?;
    let fit = py
        .core(|| pose::refine_pose(&camera, &features, &pixels, &start))?
        .map_err(|error| to_python(py, error))?;
    Ok((
        convert::matrix_out(py, &fit.t_camera_target.to_matrix()),
        fit.rmse_px,
        convert::matrix_out(py, &fit.information),
    ))
}

#[pyfunction]
fn camera_shift(
    py: Python<'_>,
    lens: &str,
    before: Array<'_>,
    after: Array<'_>,
    size_px: (f64, f64),
) -> PyResult<f64> {
    let (before, after) = (camera(py, lens, &before)?, camera(py, lens, &after)?);
    Ok(before.largest_shift_px(&after, size_px.into()))
}

/// Vectors with NaN rows where there is none, and which there are.
fn optional_out<'py, const D: usize>(
    py: Python<'py>,
    vectors: &[Option<SVector<f64, D>>],
    missing: SVector<f64, D>,
) -> (Floats<'py>, Flags<'py>) {
    let valid: Vec<bool> = vectors.iter().map(Option::is_some).collect();
    let filled: Vec<_> = vectors.iter().map(|v| v.unwrap_or(missing)).collect();
    (convert::vectors_out(py, &filled), valid.into_pyarray(py))
}
