//! numpy to nalgebra and back, with shape checks that name the argument.
//!
//! Everything is copied on the way in, so that the interpreter lock can be released afterwards; only long arrays that
//! are read once ([`rows`], [`entries`], [`row_major`]) stay where they are.

use std::borrow::Cow;

use handeye_core::se3::Se3;
use nalgebra::{Matrix4, SMatrix, SVector};
use numpy::ndarray::{ArrayD, ArrayViewD, IxDyn};
use numpy::{
    AllowTypeChange, IntoPyArray, PyArray1, PyArrayDyn, PyArrayLikeDyn, PyArrayMethods,
    PyUntypedArrayMethods, ToPyArray,
};
use pyo3::prelude::*;

use crate::errors::{invalid, to_python};

/// Anything that `numpy.asarray(..., float64)` accepts.
pub struct Array<'py>(Bound<'py, PyArrayDyn<f64>>);

impl<'py> FromPyObject<'_, 'py> for Array<'py> {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(array) = object.cast::<PyArrayDyn<f64>>() {
            // Out of a packed record, a number may begin at any byte.
            return Ok(Self(if array.data().is_aligned() {
                array.to_owned()
            } else {
                array.call_method0("copy")?.cast_into()?
            }));
        }
        let converted: PyArrayLikeDyn<'py, f64, AllowTypeChange> = object.extract()?;
        Ok(Self(converted.as_any().cast::<PyArrayDyn<f64>>()?.clone()))
    }
}

impl Array<'_> {
    /// Sizes of its dimensions.
    pub fn shape(&self) -> &[usize] {
        self.0.shape()
    }
}

/// Anything that is a sequence of whole numbers, none negative.
pub struct Indices(pub Vec<usize>);

impl<'py> FromPyObject<'_, 'py> for Indices {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(array) = object.cast::<PyArray1<i64>>()
            && let Ok(values) = array.to_vec()
            && let Ok(indices) = values.into_iter().map(usize::try_from).collect()
        {
            return Ok(Self(indices));
        }
        object.extract().map(Self)
    }
}

/// Checks a shape against a pattern; `None` stands for any size.
fn check_shape(py: Python<'_>, name: &str, array: &Array<'_>, pattern: &[Option<usize>]) -> PyResult<()> {
    let shape = array.shape();
    let fits =
        shape.len() == pattern.len() && shape.iter().zip(pattern).all(|(n, p)| p.is_none_or(|p| p == *n));
    if fits {
        return Ok(());
    }
    let expected: Vec<String> =
        pattern.iter().map(|p| p.map_or_else(|| "N".to_owned(), |p| p.to_string())).collect();
    let found: Vec<String> = shape.iter().map(ToString::to_string).collect();
    Err(invalid(
        py,
        &format!("{name} must have shape ({}), found ({})", expected.join(", "), found.join(", ")),
    ))
}

/// Rows of an `(N, D)` array.
pub fn vectors<const D: usize>(
    py: Python<'_>,
    name: &str,
    array: &Array<'_>,
) -> PyResult<Vec<SVector<f64, D>>> {
    Ok(rows::<D>(py, name, array)?.chunks_exact(D).map(SVector::from_column_slice).collect())
}

/// Entries of an `(N,)` array.
pub fn scalars(py: Python<'_>, name: &str, array: &Array<'_>) -> PyResult<Vec<f64>> {
    Ok(entries(py, name, array)?.into_owned())
}

/// As [`scalars`], in place where they lie in a row.
pub fn entries<'a>(py: Python<'_>, name: &str, array: &'a Array<'_>) -> PyResult<Cow<'a, [f64]>> {
    check_shape(py, name, array, &[None])?;
    Ok(in_place(array))
}

/// Entries of an `(N, D)` array in row-major order, in place where they lie that way.
pub fn rows<'a, const D: usize>(
    py: Python<'_>,
    name: &str,
    array: &'a Array<'_>,
) -> PyResult<Cow<'a, [f64]>> {
    check_shape(py, name, array, &[None, Some(D)])?;
    Ok(in_place(array))
}

/// Entries in row-major order, in place where they lie that way.
pub fn in_place<'a>(array: &'a Array<'_>) -> Cow<'a, [f64]> {
    // SAFETY: the reference keeps the array alive, and nothing in this module writes to an array that came in. That
    // nothing in Python does so meanwhile is what numpy relies on too; the crate's register of borrows would not see
    // it, and asking it takes longer than reading a short array.
    unsafe {
        match array.0.as_slice() {
            // A slice is given of column-major arrays too.
            Ok(entries) if array.0.is_c_contiguous() => Cow::Borrowed(entries),
            _ => Cow::Owned(array.0.as_array().iter().copied().collect()),
        }
    }
}

/// Matrices of an `(N, R, C)` array.
pub fn matrices<const R: usize, const C: usize>(
    py: Python<'_>,
    name: &str,
    array: &Array<'_>,
) -> PyResult<Vec<SMatrix<f64, R, C>>> {
    Ok(row_major::<R, C>(py, name, array)?.chunks_exact(R * C).map(SMatrix::from_row_slice).collect())
}

/// One `(R, C)` matrix.
pub fn matrix<const R: usize, const C: usize>(
    py: Python<'_>,
    name: &str,
    array: &Array<'_>,
) -> PyResult<SMatrix<f64, R, C>> {
    check_shape(py, name, array, &[Some(R), Some(C)])?;
    Ok(SMatrix::from_row_slice(&in_place(array)))
}

/// One rigid transform out of a `(4, 4)` array.
pub fn transform(py: Python<'_>, name: &str, array: &Array<'_>) -> PyResult<Se3> {
    check_shape(py, name, array, &[Some(4), Some(4)])?;
    rigid(py, || name.to_owned(), &in_place(array))
}

/// Entries of an `(N, R, C)` array in row-major order, in place where they lie that way.
///
/// In place they are read while the interpreter lock is released, as numpy itself does.
pub fn row_major<'a, const R: usize, const C: usize>(
    py: Python<'_>,
    name: &str,
    array: &'a Array<'_>,
) -> PyResult<Cow<'a, [f64]>> {
    check_shape(py, name, array, &[None, Some(R), Some(C)])?;
    Ok(in_place(array))
}

/// Rigid transforms out of an `(N, 4, 4)` array; an error names the index.
pub fn transforms(py: Python<'_>, name: &str, array: &Array<'_>) -> PyResult<Vec<Se3>> {
    let entries = row_major::<4, 4>(py, name, array)?;
    let mut transforms = Vec::with_capacity(entries.len() / 16);
    for (i, m) in entries.chunks_exact(16).enumerate() {
        transforms.push(rigid(py, || format!("{name}[{i}]"), m)?);
    }
    Ok(transforms)
}

fn rigid(py: Python<'_>, name: impl Fn() -> String, m: &[f64]) -> PyResult<Se3> {
    Se3::from_row_major(m).map_err(|error| {
        let error = to_python(py, error);
        let message = format!("{} is {}", name(), error.value(py));
        match error.value(py).setattr("args", (message,)) {
            Ok(()) => error,
            Err(broken) => broken,
        }
    })
}

/// Entries that are sooner copied than handed over.
const FEW: usize = 512;

/// An array of the given shape from its entries in row-major order.
pub fn array<'py>(py: Python<'py>, shape: &[usize], entries: Vec<f64>) -> Bound<'py, PyArrayDyn<f64>> {
    if entries.len() <= FEW {
        return slice_out(py, shape, &entries);
    }
    ArrayD::from_shape_vec(IxDyn(shape), entries)
        .expect("as many entries as the shape says, by construction")
        .into_pyarray(py)
}

/// As [`array`], copied.
fn slice_out<'py>(py: Python<'py>, shape: &[usize], entries: &[f64]) -> Bound<'py, PyArrayDyn<f64>> {
    ArrayViewD::from_shape(IxDyn(shape), entries)
        .expect("as many entries as the shape says, by construction")
        .to_pyarray(py)
}

/// An `(N, D)` array.
pub fn vectors_out<'py, const D: usize>(
    py: Python<'py>,
    vectors: &[SVector<f64, D>],
) -> Bound<'py, PyArrayDyn<f64>> {
    array(py, &[vectors.len(), D], vectors.iter().flat_map(|v| v.iter().copied()).collect())
}

/// An `(R, C)` array.
pub fn matrix_out<'py, const R: usize, const C: usize>(
    py: Python<'py>,
    m: &SMatrix<f64, R, C>,
) -> Bound<'py, PyArrayDyn<f64>> {
    slice_out(py, &[R, C], m.transpose().as_slice())
}

/// An `(N, R, C)` array.
pub fn matrices_out<'py, const R: usize, const C: usize>(
    py: Python<'py>,
    matrices: &[SMatrix<f64, R, C>],
) -> Bound<'py, PyArrayDyn<f64>> {
    matrices_columns_out(py, matrices, C)
}

/// An `(N, R, columns)` array of the first columns of each matrix.
pub fn matrices_columns_out<'py, const R: usize, const C: usize>(
    py: Python<'py>,
    matrices: &[SMatrix<f64, R, C>],
    columns: usize,
) -> Bound<'py, PyArrayDyn<f64>> {
    let entry = |m: &SMatrix<f64, R, C>, i: usize| m[(i / columns, i % columns)];
    let entries = matrices.iter().flat_map(|m| (0..R * columns).map(move |i| entry(m, i))).collect();
    array(py, &[matrices.len(), R, columns], entries)
}

/// An `(N, 4, 4)` array of transforms.
pub fn transforms_out<'py>(py: Python<'py>, transforms: &[Se3]) -> Bound<'py, PyArrayDyn<f64>> {
    let matrices: Vec<Matrix4<f64>> = transforms.iter().map(Se3::to_matrix).collect();
    matrices_out(py, &matrices)
}

/// An `(N,)` array.
pub fn scalars_out(py: Python<'_>, values: Vec<f64>) -> Bound<'_, PyArrayDyn<f64>> {
    array(py, &[values.len()], values)
}

/// An `(R, C)` array of a matrix of any size.
pub fn dynamic_out<'py>(py: Python<'py>, m: &nalgebra::DMatrix<f64>) -> Bound<'py, PyArrayDyn<f64>> {
    slice_out(py, &[m.nrows(), m.ncols()], m.transpose().as_slice())
}

/// An `(N, R, C)` array of matrices of one size.
pub fn dynamics_out<'py>(
    py: Python<'py>,
    all: &[nalgebra::DMatrix<f64>],
    rows: usize,
    columns: usize,
) -> Bound<'py, PyArrayDyn<f64>> {
    array(
        py,
        &[all.len(), rows, columns],
        all.iter().flat_map(|m| m.transpose().as_slice().to_vec()).collect(),
    )
}
