//! Where boards lie in pictures.

use std::sync::Arc;

use crate::call::CallCore;
use handeye_core::imaging::alignment::Alignment as CoreAlignment;
use handeye_core::imaging::plane_map::PlaneMap as CoreMap;
use handeye_core::imaging::printed::Printed as CorePrinted;
use nalgebra::{Matrix2, Vector2};
use numpy::{PyArrayDyn, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::convert::{self, Array};
use crate::errors::{invalid, to_python};
use crate::imaging::picture;

/// Registers the classes of this file.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<PlaneMap>()?;
    module.add_class::<Printed>()?;
    module.add_class::<Alignment>()
}

/// A map from the plane of a target to pixels.
#[pyclass(frozen, module = "handeye._core")]
pub struct PlaneMap {
    inner: CoreMap,
}

/// The printed picture of a board.
#[pyclass(frozen, module = "handeye._core")]
pub struct Printed {
    inner: Arc<CorePrinted>,
}

/// Where a board lies in an image.
#[pyclass(frozen, module = "handeye._core")]
pub struct Alignment {
    inner: CoreAlignment,
}

type Values<'py> = PyResult<Bound<'py, PyArrayDyn<f64>>>;

fn places(py: Python<'_>, plane: &Array<'_>) -> PyResult<Vec<Vector2<f64>>> {
    convert::vectors::<2>(py, "plane", plane)
}

fn pixels<'py>(
    py: Python<'py>,
    plane: &Array<'py>,
    map: impl Fn(&Vector2<f64>) -> Vector2<f64>,
) -> Values<'py> {
    let places = places(py, plane)?;
    Ok(convert::array(py, &[places.len(), 2], places.iter().flat_map(|p| <[f64; 2]>::from(map(p))).collect()))
}

fn steps<'py>(
    py: Python<'py>,
    plane: &Array<'py>,
    map: impl Fn(&Vector2<f64>) -> Matrix2<f64>,
) -> Values<'py> {
    let places = places(py, plane)?;
    let found = places.iter().flat_map(|p| {
        let m = map(p);
        [m[(0, 0)], m[(0, 1)], m[(1, 0)], m[(1, 1)]]
    });
    Ok(convert::array(py, &[places.len(), 2, 2], found.collect()))
}

fn values<'py>(py: Python<'py>, plane: &Array<'py>, map: impl Fn(&Vector2<f64>) -> f32) -> Values<'py> {
    let places = places(py, plane)?;
    Ok(convert::array(py, &[places.len()], places.iter().map(|p| f64::from(map(p))).collect()))
}

#[pymethods]
impl PlaneMap {
    #[staticmethod]
    fn fitted<'py>(py: Python<'py>, plane: Array<'py>, pixels: Array<'py>) -> PyResult<Option<Self>> {
        let (plane, pixels) = (places(py, &plane)?, convert::vectors::<2>(py, "pixels", &pixels)?);
        Ok(CoreMap::fitted(&plane, &pixels).map(|inner| Self { inner }))
    }

    fn pixels<'py>(&self, py: Python<'py>, plane: Array<'py>) -> Values<'py> {
        pixels(py, &plane, |place| self.inner.pixel(place))
    }

    fn steps<'py>(&self, py: Python<'py>, plane: Array<'py>, half: f64) -> Values<'py> {
        steps(py, &plane, |place| self.inner.steps(place, half))
    }
}

#[pymethods]
impl Printed {
    #[new]
    fn new(
        py: Python<'_>,
        picture: PyReadonlyArray2<'_, f32>,
        low: [f64; 2],
        scale: f64,
        pitch: f64,
        light_px: usize,
    ) -> PyResult<Self> {
        let size = [picture.shape()[1], picture.shape()[0]];
        let values = picture.as_array().iter().copied().collect();
        CorePrinted::new(values, size, low, scale, pitch, light_px)
            .map(|inner| Self { inner: Arc::new(inner) })
            .map_err(|e| to_python(py, e))
    }

    fn align<'py>(
        &self,
        py: Python<'py>,
        image: PyReadonlyArray2<'py, u8>,
        plane: Array<'py>,
        pixels: Array<'py>,
        margin_px: f64,
        also_negative: bool,
    ) -> PyResult<Option<Alignment>> {
        let (plane, pixels) = (places(py, &plane)?, convert::vectors::<2>(py, "pixels", &pixels)?);
        if plane.len() != pixels.len() {
            return Err(invalid(py, &format!("{} places and {} pixels", plane.len(), pixels.len())));
        }
        let image = picture(py, &image)?;
        let found =
            py.core(|| CoreAlignment::of(&self.inner, &image, &plane, &pixels, margin_px, also_negative))?;
        Ok(found.map(|inner| Alignment { inner }))
    }

    fn drawn<'py>(&self, py: Python<'py>, plane: Array<'py>) -> Values<'py> {
        values(py, &plane, |place| self.inner.drawn(place))
    }
}

#[pymethods]
impl Alignment {
    fn places<'py>(&self, py: Python<'py>, plane: Array<'py>) -> Values<'py> {
        pixels(py, &plane, |place| self.inner.pixel(place))
    }

    fn steps<'py>(&self, py: Python<'py>, plane: Array<'py>) -> Values<'py> {
        steps(py, &plane, |place| self.inner.steps(place))
    }

    fn seen<'py>(&self, py: Python<'py>, plane: Array<'py>) -> Values<'py> {
        values(py, &plane, |place| self.inner.seen(place))
    }

    fn likeness<'py>(&self, py: Python<'py>, plane: Array<'py>) -> Values<'py> {
        values(py, &plane, |place| self.inner.likeness(place))
    }
}
