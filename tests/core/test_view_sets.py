"""Sets of views are weighed as Gaussians written out whole say."""

import numpy as np
import pytest

from handeye import _core
from handeye.errors import InputError

VIEWS, SIZE = 4, 14


class Views:
    """Random views, their prior and levels of noise on either side."""

    def __init__(self, seed: int) -> None:
        random = np.random.default_rng(seed)
        self.deviations = random.standard_normal((VIEWS, 6))
        self.rows = random.standard_normal((VIEWS, 6, SIZE))
        root = random.standard_normal((VIEWS, 6, 6))
        self.covariances = 0.3 * root @ np.swapaxes(root, 1, 2) + 0.01 * np.eye(6)
        self.from_robot = _core.se3_adjoint(_core.se3_exp(random.standard_normal((2 * VIEWS, 6))))
        root = random.standard_normal((SIZE, SIZE))
        self.prior = root @ root.T + 0.1 * np.eye(SIZE)
        self.prior_right = random.standard_normal(SIZE)
        self.left = np.arange(11) % 3 > 0
        self.sigmas = random.uniform(0.01, 2.0, (11, 2))

    def sets(self) -> _core.ViewSets:
        left, right = self.from_robot[:VIEWS], self.from_robot[VIEWS:]
        return _core.ViewSets(
            self.deviations, self.rows, self.covariances, left, right, self.prior, self.prior_right
        )

    def whole(self, level: int, members: list[int]) -> tuple[np.ndarray, np.ndarray, float]:
        """Covariance, mean and log-likelihood, every matrix written out."""
        at = 0 if self.left[level] else VIEWS
        noise = np.zeros((6 * len(members), 6 * len(members)))
        for n, k in enumerate(members):
            root = self.from_robot[at + k] * np.repeat(self.sigmas[level], 3)
            noise[6 * n : 6 * n + 6, 6 * n : 6 * n + 6] = self.covariances[k] + root @ root.T
        rows, seen = self.rows[members].reshape(-1, SIZE), self.deviations[members].ravel()
        covariance = np.linalg.inv(self.prior + rows.T @ np.linalg.inv(noise) @ rows)
        before = np.linalg.solve(self.prior, self.prior_right)
        mean = covariance @ (self.prior_right - rows.T @ np.linalg.solve(noise, seen))
        spread = noise + rows @ np.linalg.inv(self.prior) @ rows.T
        off = seen + rows @ before
        log = -0.5 * (
            off @ np.linalg.solve(spread, off) + np.linalg.slogdet(spread)[1] + len(seen) * np.log(2 * np.pi)
        )
        return covariance, mean, log + 0.5 * self.prior_right @ before


@pytest.mark.parametrize("members", [[0, 1, 2, 3], [2], [3, 0], []])
def test_fits_are_those_of_the_whole_gaussian(members: list[int]) -> None:
    views = Views(len(members))
    covariances, means, logs = views.sets().fit(views.left, views.sigmas[:, 0], views.sigmas[:, 1], members)
    for level in range(len(views.left)):
        covariance, mean, log = views.whole(level, members)
        np.testing.assert_allclose(covariances[level], covariance, rtol=1e-8, atol=1e-9)
        np.testing.assert_allclose(means[level], mean, rtol=1e-8, atol=1e-9)
        assert logs[level] == pytest.approx(log, abs=1e-8)


def test_what_does_not_fit_together_is_refused() -> None:
    views = Views(0)
    with pytest.raises(InputError, match="view 4 of 4"):
        views.sets().fit(views.left, views.sigmas[:, 0], views.sigmas[:, 1], [0, 4])
    with pytest.raises(InputError, match="side"):
        views.sets().fit(views.left[:3], views.sigmas[:, 0], views.sigmas[:, 1], [0])
    views.prior = -views.prior
    with pytest.raises(InputError, match="positive definite"):
        views.sets()
    views.deviations = views.deviations[:2]
    with pytest.raises(InputError, match="views"):
        views.sets()
