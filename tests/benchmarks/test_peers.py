"""Peers give the same answers as the core, or say why they cannot take part."""

import numpy as np
import pytest

from handeye import _core
from handeye.benchmarks.options import Options
from handeye.benchmarks.peers import chain, programs, scorers, solvers
from handeye.benchmarks.peers.availability import MissingPeerError, optional
from handeye.benchmarks.problems import LENSES, candidates, make_cell
from handeye.benchmarks.score import belief_of, predictor_of
from handeye.benchmarks.solve import bench_solve, ours

# Those that need nothing beyond what the tests have; the others need minutes of a compiler, or are not there.
SOLVERS = ("scipy", "opencv_shah")
SCORERS = ("numpy_batched", "numpy_reduced", "numpy_loop")


def test_derivatives_of_the_chain() -> None:
    cell = make_cell("pinhole", 3, 16, 1)
    values = chain.stacked(cell.X_start, cell.Y_start)
    X, Y = chain.unstacked(values)
    np.testing.assert_allclose(X, cell.X_start, atol=1e-12)
    np.testing.assert_allclose(Y, cell.Y_start, atol=1e-12)
    step = 1e-6
    numeric = [
        (chain.residuals(cell, values + step * e) - chain.residuals(cell, values - step * e)) / (2 * step)
        for e in np.eye(12)
    ]
    np.testing.assert_allclose(chain.jacobian(cell, values), np.transpose(numeric), rtol=1e-5, atol=1e-3)


@pytest.mark.parametrize("name", SOLVERS)
def test_solvers_reach_the_same_optimum(name: str) -> None:
    cell = make_cell("pinhole", 8, 88, 0)
    problem = cell.problem()
    least = problem.squared_error(*ours(cell)())
    found = problem.squared_error(*solvers.PEERS[name].prepare(cell)())
    assert found / least - 1 < (1.0 if solvers.PEERS[name].closed_form else 1e-6)
    assert found / least - 1 > -1e-6


def test_a_factor_graph_reaches_the_same_optimum() -> None:
    pytest.importorskip("gtsam", reason="the peers of requirements/bench.txt are not installed")
    test_solvers_reach_the_same_optimum("gtsam")


@pytest.mark.parametrize("name", SCORERS)
def test_scorers_give_the_same_gains(name: str) -> None:
    cell = make_cell("pinhole", 5, 16, 0)
    motions = candidates(cell, 300, 0)
    belief, information = belief_of(cell)
    expected = predictor_of(cell).gains(belief, _core.Criterion("entropy"), motions)
    assert np.isfinite(expected).all()
    found = scorers.PEERS[name].prepare(cell, information, motions)()
    np.testing.assert_allclose(found, expected, atol=1e-10)


@pytest.mark.parametrize("lens", LENSES)
def test_cells_are_repeatable_and_in_sight(lens: str) -> None:
    one, two = make_cell(lens, 4, 88, 5), make_cell(lens, 4, 88, 5)
    np.testing.assert_array_equal(one.pixels, two.pixels)
    assert (one.pixels > -5).all()
    assert (one.pixels < [1285, 1029]).all()
    assert not np.array_equal(one.pixels, make_cell(lens, 4, 88, 6).pixels)


def test_missing_peers_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(MissingPeerError, match="nothing_of_this_name is not installed"):
        optional("nothing_of_this_name")
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CXX", raising=False)
    with pytest.raises(MissingPeerError, match="no C"):
        programs.compiler()
    assert programs.compiler_version() is None

    def missing(_: object) -> None:
        raise MissingPeerError("not today")

    peer = solvers.SolvePeer("a peer", missing)  # type: ignore[arg-type]
    monkeypatch.setattr(solvers, "PEERS", {"absent": peer})
    monkeypatch.setattr("handeye.benchmarks.solve.PEERS", {"absent": peer})
    found = bench_solve(Options(budget_s=0, quick=True), lambda done, total: None)
    assert found["skipped"] == {"absent": "not today"}
    assert all(list(size["methods"]) == ["handeye"] for size in found["sizes"].values())


def test_a_source_that_is_not_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(programs, "PLACES", ())
    with pytest.raises(MissingPeerError, match="was not found"):
        programs.built("ceres_solve", [])


@pytest.mark.parametrize(
    "why",
    ["a.cpp:3:10: fatal error: ceres/ceres.h: No such file", "ld: cannot find -lceres", "cannot find -lglog"],
)
def test_without_ceres_for_cpp_the_command_that_brings_it_is_named(
    monkeypatch: pytest.MonkeyPatch, why: str
) -> None:
    def built(name: str, _libraries: list[str]) -> None:
        raise MissingPeerError(f"{name}.cpp did not compile: {why}")

    monkeypatch.setattr(programs, "built", built)
    with pytest.raises(MissingPeerError, match="apt-get install libceres-dev"):
        programs.ceres_solve()
