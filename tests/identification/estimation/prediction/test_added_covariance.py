"""Process noise of a step against Van Loan's block exponential and against its own definition."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad_vec
from scipy.linalg import expm, solve_continuous_lyapunov

from bondgraph.support.arrays import Array
from identification.estimation.prediction.diffusion import added_covariance

NONE = np.zeros((0, 3, 3))


def random_pair(seed: int) -> tuple[Array, Array]:
    rng = np.random.default_rng(seed)
    g = rng.standard_normal((3, 2))
    return rng.standard_normal((3, 3)) - 1.0 * np.eye(3), g @ g.T


def van_loan(a: Array, s: Array, h: float) -> Array:
    n = a.shape[0]
    block = np.zeros((2 * n, 2 * n))
    block[:n, :n], block[:n, n:], block[n:, n:] = -a, s, a.T
    e = expm(block * h)
    return np.asarray(e[n:, n:].T @ e[:n, n:])


@pytest.mark.parametrize("step", [1e-4, 0.1, 1.0])
def test_equals_van_loan(step: float) -> None:
    a, s = random_pair(3)
    found = added_covariance(a, s, step, NONE, NONE)[0]
    wanted = van_loan(a, s, step)
    assert np.abs(found - wanted).max() < 1e-11 * np.abs(wanted).max()


def test_equals_the_integral() -> None:
    a, s = random_pair(4)
    wanted, _ = quad_vec(lambda t: expm(a * t) @ s @ expm(a.T * t), 0.0, 0.7, epsabs=1e-12)
    assert np.allclose(added_covariance(a, s, 0.7, NONE, NONE)[0], wanted, rtol=1e-9, atol=0)


def test_two_steps_make_one_of_twice_the_length() -> None:
    a, s = random_pair(5)
    one = added_covariance(a, s, 0.3, NONE, NONE)[0]
    phi = expm(a * 0.3)
    two = added_covariance(a, s, 0.6, NONE, NONE)[0]
    assert np.allclose(two, phi @ one @ phi.T + one, rtol=1e-12, atol=1e-14)


def test_stiff_dynamics_settle_where_van_loan_overflows() -> None:
    a = np.array([[-1e6, 3e5, 0.0], [0.0, -2e3, 1.0], [0.0, 0.0, -5.0]])
    s = np.diag([1.0, 2.0, 3.0])
    # the step is far beyond the largest exponent of a double
    found = added_covariance(a, s, 10.0, NONE, NONE)[0]
    wanted = solve_continuous_lyapunov(a, -s)
    assert np.allclose(found, wanted, rtol=1e-9)


def test_derivatives_equal_differences() -> None:
    a, s = random_pair(6)
    da, ds = random_pair(7)
    both = added_covariance(a, s, 0.8, da[None], ds[None])[1][0]
    e = 1e-6
    up = added_covariance(a + e * da, s + e * ds, 0.8, NONE, NONE)[0]
    down = added_covariance(a - e * da, s - e * ds, 0.8, NONE, NONE)[0]
    assert np.allclose(both, (up - down) / (2 * e), rtol=1e-7, atol=1e-8)
