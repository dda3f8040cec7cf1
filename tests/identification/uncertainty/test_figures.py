"""Figures show what the numbers say."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph.support.errors import UnusableInput
from identification.uncertainty.figures import correlation_figure, profile_figure
from identification.uncertainty.information import Sensitivities, information
from identification.uncertainty.profile import profile, threshold_of


def test_profiles_are_drawn_with_their_shape() -> None:
    p = profile(
        lambda x, s: (float((x / 0.1) ** 2), s), "k", 1.0, 0.0, None,
        width=0.1, threshold=threshold_of(), unit="N/m",
    )  # fmt: skip
    figure = profile_figure([p, p])
    assert [a.get_title("left") for a in figure.axes] == ["k: two-sided"] * 2
    assert figure.axes[0].get_xlabel() == "k (N/m)"
    with pytest.raises(UnusableInput, match="no profile"):
        profile_figure([])


def test_correlations_leave_open_parameters_blank() -> None:
    rng = np.random.default_rng(0)
    j = rng.standard_normal((40, 3))
    j[:, 2] = 0.0
    figure = correlation_figure(information(Sensitivities(("a", "b", "c"), np.ones(3), j)))
    texts = [t.get_text() for t in figure.axes[0].texts]
    assert len(texts) == 4
    assert texts.count("1.00") == 2
