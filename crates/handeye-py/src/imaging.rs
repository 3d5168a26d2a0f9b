//! Measuring in pictures.

use crate::call::CallCore;
use handeye_core::error::Error;
use handeye_core::imaging::Picture;
use handeye_core::imaging::corner::{Corner, CornerFitter, CornerGuess, CornerKind};
use handeye_core::imaging::neighbours::{Crossing, neighbours};
use handeye_core::imaging::spot::{Spot, area_centroid, free_gaps as core_free_gaps};
use handeye_core::interrupt::checked;
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray2, PyArrayDyn, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::convert::{self, Array};
use crate::errors::to_python;

/// Registers the functions of this file.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(fit_corners, module)?)?;
    module.add_function(wrap_pyfunction!(crossing_neighbours, module)?)?;
    module.add_function(wrap_pyfunction!(area_centroids, module)?)?;
    module.add_function(wrap_pyfunction!(free_gaps, module)?)
}

/// Checks that all arguments have the length of the first.
fn same_length(py: Python<'_>, lengths: &[usize]) -> PyResult<()> {
    if lengths.iter().all(|n| *n == lengths[0]) {
        return Ok(());
    }
    Err(to_python(py, Error::invalid(format!("arguments of different lengths: {lengths:?}"))))
}

/// A contiguous array as a picture.
pub fn picture<'a, T: numpy::Element + Copy + Into<f32>>(
    py: Python<'_>,
    image: &'a PyReadonlyArray2<'_, T>,
) -> PyResult<Picture<'a, T>> {
    let (height, width) = (image.shape()[0], image.shape()[1]);
    let grey = image
        .as_slice()
        .map_err(|_| to_python(py, Error::invalid("the image is not contiguous in memory")))?;
    Picture::new(grey, width, height).map_err(|e| to_python(py, e))
}

/// Places, covariances of them for residuals of one grey value, misfits, those that may move them, contrasts and blurs.
type Fits<'py> = (
    Bound<'py, PyArrayDyn<f64>>,
    Bound<'py, PyArrayDyn<f64>>,
    Bound<'py, PyArrayDyn<f64>>,
    Bound<'py, PyArrayDyn<f64>>,
    Bound<'py, PyArrayDyn<f64>>,
    Bound<'py, PyArrayDyn<f64>>,
);

#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "one array for each part of the guess")]
fn fit_corners<'py>(
    py: Python<'py>,
    image: PyReadonlyArray2<'py, u8>,
    places: Array<'py>,
    directions: Array<'py>,
    curvatures: Array<'py>,
    radii: Array<'py>,
    beyonds: Array<'py>,
    bands: Array<'py>,
    turns: Array<'py>,
    is_crossing: bool,
    rough: bool,
) -> PyResult<Fits<'py>> {
    let places = convert::vectors::<2>(py, "places", &places)?;
    let directions = convert::matrices::<2, 2>(py, "directions", &directions)?;
    let curvatures = convert::vectors::<2>(py, "curvatures", &curvatures)?;
    let radii = convert::scalars(py, "radii", &radii)?;
    let beyonds = convert::scalars(py, "beyonds", &beyonds)?;
    let bands = convert::scalars(py, "bands", &bands)?;
    let turns = convert::scalars(py, "turns", &turns)?;
    let n = places.len();
    same_length(
        py,
        &[n, directions.len(), curvatures.len(), radii.len(), beyonds.len(), bands.len(), turns.len()],
    )?;
    let kind = if is_crossing { CornerKind::Crossing } else { CornerKind::Quadrants };
    let picture = picture(py, &image)?;
    let guesses = (0..n).map(|i| CornerGuess {
        place: places[i].into(),
        directions: [0, 1].map(|k| [directions[i][(k, 0)], directions[i][(k, 1)]]),
        curvatures: curvatures[i].into(),
        radius: radii[i],
        beyond: beyonds[i],
        band: bands[i],
        turn: turns[i],
    });
    let found: Vec<Option<Corner>> = py.core(|| {
        let mut fitter = CornerFitter::new(picture, kind);
        checked(guesses).map(|guess| fitter.fit(&guess, rough)).collect()
    })?;
    let place = |c: &Option<Corner>| c.map_or([f64::NAN; 2], |c| c.place);
    let spread = |c: &Option<Corner>| c.map_or([[f64::NAN; 2]; 2], |c| c.spread).into_iter().flatten();
    Ok((
        convert::array(py, &[n, 2], found.iter().flat_map(place).collect()),
        convert::array(py, &[n, 2, 2], found.iter().flat_map(spread).collect()),
        convert::array(py, &[n], found.iter().map(|c| c.map_or(f64::NAN, |c| c.misfit)).collect()),
        convert::array(py, &[n], found.iter().map(|c| c.map_or(f64::NAN, |c| c.noise)).collect()),
        convert::array(py, &[n], found.iter().map(|c| c.map_or(f64::NAN, |c| c.contrast)).collect()),
        convert::array(py, &[n], found.iter().map(|c| c.map_or(f64::NAN, |c| c.blur)).collect()),
    ))
}

#[pyfunction]
fn crossing_neighbours<'py>(
    py: Python<'py>,
    places: Array<'py>,
    angles: Array<'py>,
    off: f64,
) -> PyResult<Bound<'py, PyArray2<i64>>> {
    let places = convert::vectors::<2>(py, "places", &places)?;
    let angles = convert::vectors::<2>(py, "angles", &angles)?;
    same_length(py, &[places.len(), angles.len()])?;
    let crossings: Vec<_> = places
        .iter()
        .zip(&angles)
        .map(|(place, angles)| Crossing { place: (*place).into(), angles: (*angles).into() })
        .collect();
    let found = py.core(|| neighbours(&crossings, off))?;
    let number = |ray: Option<usize>| ray.and_then(|i| i64::try_from(i).ok()).unwrap_or(-1);
    Ok(Array2::from_shape_fn((found.len(), 4), |(i, k)| number(found[i][k])).into_pyarray(py))
}

type Spots<'py> = (Bound<'py, PyArrayDyn<f64>>, Bound<'py, PyArrayDyn<f64>>);

#[pyfunction]
fn area_centroids<'py>(
    py: Python<'py>,
    image: PyReadonlyArray2<'py, u8>,
    centres: Array<'py>,
    shapes: Array<'py>,
    gaps: Array<'py>,
) -> PyResult<Spots<'py>> {
    let centres = convert::vectors::<2>(py, "centres", &centres)?;
    let shapes = convert::matrices::<2, 2>(py, "shapes", &shapes)?;
    let gaps = convert::scalars(py, "gaps", &gaps)?;
    let n = centres.len();
    same_length(py, &[n, shapes.len(), gaps.len()])?;
    let picture = picture(py, &image)?;
    let found: Vec<Option<Spot>> = py.core(|| {
        checked(0..n)
            .map(|i| area_centroid(&picture, &Spot { centre: centres[i], shape: shapes[i] }, gaps[i]))
            .collect()
    })?;
    let centre = |s: &Option<Spot>| s.map_or([f64::NAN; 2], |s| s.centre.into());
    let shape = |s: &Option<Spot>| {
        s.map_or([f64::NAN; 4], |s| [s.shape[(0, 0)], s.shape[(0, 1)], s.shape[(1, 0)], s.shape[(1, 1)]])
    };
    Ok((
        convert::array(py, &[n, 2], found.iter().flat_map(centre).collect()),
        convert::array(py, &[n, 2, 2], found.iter().flat_map(shape).collect()),
    ))
}

#[pyfunction]
fn free_gaps<'py>(
    py: Python<'py>,
    centres: Array<'py>,
    shapes: Array<'py>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let centres = convert::vectors::<2>(py, "centres", &centres)?;
    let shapes = convert::matrices::<2, 2>(py, "shapes", &shapes)?;
    same_length(py, &[centres.len(), shapes.len()])?;
    let spots: Vec<_> =
        centres.into_iter().zip(shapes).map(|(centre, shape)| Spot { centre, shape }).collect();
    let gaps = py.core(|| core_free_gaps(&spots))?;
    Ok(convert::array(py, &[spots.len()], gaps))
}
