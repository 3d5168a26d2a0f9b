"""Work on a Dask cluster on loopback: the same results to the bit, whatever dies meanwhile."""

from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from clusters import LocalCluster, local_cluster
from handeye.compute import cluster as room
from handeye.compute.checkpoint import Checkpoint
from handeye.compute.cluster import Cluster
from handeye.compute.parallel import run_all
from handeye.errors import InputError
from handeye.studies.coverage import CASES, study_coverage
from handeye.types import Pose

needs_dask = pytest.mark.skipif(
    find_spec("distributed") is None,
    reason="Dask is not installed (the extra `cluster`)",
)
TRIALS = 50


@pytest.fixture(scope="module")
def dask(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LocalCluster]:
    with local_cluster(tmp_path_factory.mktemp("dask")) as cluster:
        yield cluster


@needs_dask
def test_results_errors_and_the_death_of_a_worker(dask: LocalCluster, tmp_path: Path) -> None:
    cluster = Cluster(dask.address)
    told: list[tuple[int, int]] = []

    def watch(done: int, total: int) -> None:
        told.append((done, total))
        if done == 1:
            dask.workers[0].kill()

    # Errors first, while both live.
    with pytest.raises(InputError) as caught:
        run_all(Pose, [np.eye(4), np.zeros((4, 4))], workers=cluster)
    assert caught.value.code == "not_rigid"
    assert run_all(Pose, [], workers=cluster) == []

    expected = study_coverage(cases=CASES[:1], trials=TRIALS, seed=3)
    found = study_coverage(
        cases=CASES[:1], trials=TRIALS, seed=3, workers=Checkpoint(tmp_path, cluster), progress=watch
    )
    assert found == expected
    assert told == [(done, TRIALS // 10) for done in range(TRIALS // 10 + 1)]
    assert dask.workers[0].poll() is not None
    # All of it is on disk: no cluster is needed for it again.
    kept = Checkpoint(tmp_path, Cluster("tcp://127.0.0.1:9"))
    assert study_coverage(cases=CASES[:1], trials=TRIALS, seed=3, workers=kept) == expected


@needs_dask
def test_a_worker_of_another_program_is_refused(dask: LocalCluster, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(room, "program_digest", lambda: "another")
    with pytest.raises(InputError) as caught:
        run_all(Pose, [np.eye(4)], workers=Cluster(dask.address))
    assert caught.value.code == "other_program"


@needs_dask
def test_no_scheduler_answers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(room, "CONNECT_S", 0.5)
    with pytest.raises(InputError) as caught:
        run_all(abs, [1], workers=Cluster("tcp://127.0.0.1:9"))
    assert caught.value.code == "no_scheduler"


def test_without_dask(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> None:
        raise ModuleNotFoundError(name)

    monkeypatch.setattr(room, "import_module", missing)
    with pytest.raises(InputError) as caught:
        run_all(abs, [1], workers=Cluster("tcp://127.0.0.1:9"))
    assert caught.value.code == "no_dask"
