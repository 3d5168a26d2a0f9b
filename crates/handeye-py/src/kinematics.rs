//! Serial arms, batched.

use crate::call::CallCore;
use handeye_core::kinematics::{
    CapsulePair, Chain as CoreChain, Frame, InverseOptions, Joint, JointKind, least_gaps as core_least_gaps,
};
use numpy::PyArrayDyn;
use pyo3::prelude::*;

use crate::convert::{self, Array};
use crate::errors::{invalid, to_python};

/// Registers the class of this file.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(least_gaps, module)?)?;
    module.add_class::<Chain>()
}

fn frame_of(py: Python<'_>, name: &str) -> PyResult<Frame> {
    match name {
        "base" => Ok(Frame::Base),
        "flange" => Ok(Frame::Flange),
        other => Err(invalid(py, &format!("frame must be base or flange, found \"{other}\""))),
    }
}

/// Least gap `(N,)` in metres of pairs of capsules with ends among points `(N, P, 3)`: pairs `(C, 4)` of first ends, last
/// ends, and the sum of radii `(C,)` of each pair.
#[pyfunction]
fn least_gaps<'py>(
    py: Python<'py>,
    points: Array<'py>,
    pairs: Vec<[usize; 4]>,
    radii: Vec<f64>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let shape = points.shape().to_vec();
    if shape.len() != 3 || shape[2] != 3 || pairs.len() != radii.len() {
        return Err(invalid(py, &format!("points (N, P, 3) and as many radii as pairs, found {shape:?}")));
    }
    let entries = convert::in_place(&points);
    let points: Vec<_> = entries.chunks_exact(3).map(|p| [p[0], p[1], p[2]].into()).collect();
    let pairs: Vec<_> = pairs
        .into_iter()
        .zip(radii)
        .map(|([a, b, c, d], radii)| CapsulePair { one: [a, b], other: [c, d], radii })
        .collect();
    let gaps = py.core(|| core_least_gaps(&points, shape[1], &pairs))?.map_err(|e| to_python(py, e))?;
    Ok(convert::array(py, &[gaps.len()], gaps))
}

/// A serial arm.
#[pyclass(frozen, module = "handeye._core")]
pub struct Chain {
    inner: CoreChain,
}

impl Chain {
    /// Configurations out of an `(N, n)` array.
    fn configurations(&self, py: Python<'_>, joints: &Array<'_>) -> PyResult<(usize, Vec<f64>)> {
        let shape = joints.shape();
        if shape.len() != 2 || shape[1] != self.inner.len() {
            return Err(invalid(
                py,
                &format!("joints must have shape (N, {}), found {shape:?}", self.inner.len()),
            ));
        }
        Ok((shape[0], convert::in_place(joints).into_owned()))
    }
}

type Inverse<'py> = (Bound<'py, PyArrayDyn<f64>>, Vec<bool>, Vec<(f64, f64)>);

#[pymethods]
impl Chain {
    #[new]
    fn new<'py>(
        py: Python<'py>,
        placements: Array<'py>,
        axes: Array<'py>,
        sliding: Vec<bool>,
        limits: Array<'py>,
        tip: Array<'py>,
    ) -> PyResult<Self> {
        let placements = convert::transforms(py, "placements", &placements)?;
        let axes = convert::vectors::<3>(py, "axes", &axes)?;
        let limits = convert::vectors::<2>(py, "limits", &limits)?;
        let n = placements.len();
        if axes.len() != n || sliding.len() != n || limits.len() != n {
            return Err(invalid(py, "placements, axes, sliding and limits must be as many"));
        }
        let joints = (0..n)
            .map(|i| Joint {
                kind: if sliding[i] { JointKind::Prismatic } else { JointKind::Revolute },
                placement: placements[i],
                axis: axes[i],
                lower: limits[i][0],
                upper: limits[i][1],
            })
            .collect();
        let tip = convert::transform(py, "tip", &tip)?;
        CoreChain::new(joints, tip).map(|inner| Self { inner }).map_err(|e| to_python(py, e))
    }

    /// Number of joints.
    #[getter]
    fn joint_count(&self) -> usize {
        self.inner.len()
    }

    /// Poses `(N, 4, 4)` of the flange in the base at joints `(N, n)`.
    fn forward<'py>(&self, py: Python<'py>, joints: Array<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let (count, values) = self.configurations(py, &joints)?;
        let poses = py
            .core(|| {
                let mut poses = vec![0.0; count * 16];
                self.inner.forward_all(&values, &mut poses).map(|()| poses)
            })?
            .map_err(|e| to_python(py, e))?;
        Ok(convert::array(py, &[count, 4, 4], poses))
    }

    /// Poses `(N, n + 2, 4, 4)` in the base at joints `(N, n)`: the base itself, each joint, the flange.
    fn frames<'py>(&self, py: Python<'py>, joints: Array<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let (count, values) = self.configurations(py, &joints)?;
        let each = self.inner.len() + 2;
        let frames = py
            .core(|| {
                let mut frames = vec![0.0; count * each * 16];
                self.inner.frames_all(&values, &mut frames).map(|()| frames)
            })?
            .map_err(|e| to_python(py, e))?;
        Ok(convert::array(py, &[count, each, 4, 4], frames))
    }

    /// Jacobians `(N, 6, n)` at joints `(N, n)`, in the frame "base" or "flange".
    fn jacobians<'py>(
        &self,
        py: Python<'py>,
        joints: Array<'py>,
        frame: &str,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let frame = frame_of(py, frame)?;
        let (count, values) = self.configurations(py, &joints)?;
        let n = self.inner.len();
        let jacobians = py
            .core(|| {
                let mut jacobians = vec![0.0; count * 6 * n];
                self.inner.jacobian_all(frame, &values, &mut jacobians).map(|()| jacobians)
            })?
            .map_err(|e| to_python(py, e))?;
        Ok(convert::array(py, &[count, 6, n], jacobians))
    }

    /// Twists `(N, 6, m)` of the flange at joints `(N, n)`, per way of displacing a joint on the link before it: `joint`
    /// of each, and its twist `(m, 6)` in the joint's frame before it moves; in the frame "base" or "flange".
    fn displacements<'py>(
        &self,
        py: Python<'py>,
        joints: Array<'py>,
        frame: &str,
        which: Vec<usize>,
        twists: Array<'py>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let frame = frame_of(py, frame)?;
        let (count, values) = self.configurations(py, &joints)?;
        let twists = convert::vectors::<6>(py, "twists", &twists)?;
        if twists.len() != which.len() {
            return Err(invalid(py, "as many joints as twists are needed"));
        }
        let ways: Vec<_> = which.into_iter().zip(twists).collect();
        let found = py
            .core(|| {
                let mut found = vec![0.0; count * 6 * ways.len()];
                self.inner.displacements_all(frame, &values, &ways, &mut found).map(|()| found)
            })?
            .map_err(|e| to_python(py, e))?;
        Ok(convert::array(py, &[count, 6, ways.len()], found))
    }

    /// Joints `(N, n)` that reach poses `(N, 4, 4)`, which of them do, and how far off the others are (m, rad).
    #[pyo3(signature = (goals, starts, *, tolerance_m=1e-9, tolerance_rad=1e-9, steps=60, attempts=100))]
    #[expect(clippy::too_many_arguments, reason = "one keyword per option")]
    fn inverse<'py>(
        &self,
        py: Python<'py>,
        goals: Array<'py>,
        starts: Array<'py>,
        tolerance_m: f64,
        tolerance_rad: f64,
        steps: usize,
        attempts: usize,
    ) -> PyResult<Inverse<'py>> {
        let goals = convert::transforms(py, "goals", &goals)?;
        let (count, starts) = self.configurations(py, &starts)?;
        if count != goals.len() || starts.iter().any(|q| !q.is_finite()) {
            return Err(invalid(py, &format!("{count} finite starts are needed for {} goals", goals.len())));
        }
        let options = InverseOptions { tolerance_m, tolerance_rad, steps, attempts };
        let n = self.inner.len();
        let mut joints = Vec::with_capacity(count * n);
        let mut reached = Vec::with_capacity(count);
        let mut off = Vec::with_capacity(count);
        py.core(|| {
            for (goal, start) in goals.iter().zip(starts.chunks_exact(n)) {
                let (q, found, how_far) = match self.inner.inverse(goal, start, &options) {
                    Ok(reach) => (reach.joints, true, (0.0, 0.0)),
                    Err(nearest) => (nearest.joints, false, (nearest.off_m, nearest.off_rad)),
                };
                joints.extend(q);
                reached.push(found);
                off.push(how_far);
            }
        })?;
        Ok((convert::array(py, &[count, n], joints), reached, off))
    }

    /// All different postures `(S, n)` found that reach a pose `(4, 4)`.
    #[pyo3(signature = (goal, *, tolerance_m=1e-9, tolerance_rad=1e-9, steps=60, attempts=100))]
    fn postures<'py>(
        &self,
        py: Python<'py>,
        goal: Array<'py>,
        tolerance_m: f64,
        tolerance_rad: f64,
        steps: usize,
        attempts: usize,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let goal = convert::transform(py, "goal", &goal)?;
        let options = InverseOptions { tolerance_m, tolerance_rad, steps, attempts };
        let found = py.core(|| self.inner.inverse_all(&goal, &options))?;
        Ok(convert::array(py, &[found.len(), self.inner.len()], found.concat()))
    }
}
