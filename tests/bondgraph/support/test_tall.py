"""Triangles of tall matrices, in stretches as in one piece."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bondgraph.support.tall import ROWS, triangle


@given(st.integers(0, 5 * ROWS), st.integers(0, 9), st.integers(0, 2**32 - 1))
def test_a_triangle_has_the_products_of_its_matrix(height: int, width: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    a = rng.standard_normal((height, width)) * 10.0 ** rng.uniform(-6, 6, width)
    r = triangle(a)
    assert r.shape == (min(height, width), width)
    assert not np.tril(r, -1).any()
    size = np.linalg.norm(a, axis=0) + 1e-300
    np.testing.assert_allclose((r / size).T @ (r / size), (a / size).T @ (a / size), atol=1e-11)


def test_directions_that_nearly_coincide_keep_their_digits() -> None:
    """The square of the matrix would lose them: 1e-10 squared is below rounding."""
    rng = np.random.default_rng(3)
    x = rng.standard_normal(20 * ROWS)
    away = rng.standard_normal(x.size)
    away -= x * (x @ away) / (x @ x)
    r = triangle(np.stack([x, x + 1e-10 * away], axis=1))
    assert abs(r[1, 1]) == pytest.approx(1e-10 * float(np.linalg.norm(away)), rel=1e-4)
