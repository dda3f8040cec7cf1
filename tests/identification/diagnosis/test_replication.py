"""Held-out samples fitted too: what they add for a true law, an open one, and a wrong one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bondgraph.signals.split import Split
from identification.diagnosis.evidence import replication
from identification.diagnosis.evidence.replication import added, scatter
from identification.estimation.single_record import Fit, fit
from tests.identification.diagnosis.test_leave_out import small


def barely_trained(wrong: float = 0.0, share: int = 12) -> Fit:
    """Fitted to the first part of the record, the rest is held out; `wrong` is added there."""
    problem = small().problem
    data = problem.data
    first = data.n // share
    split = Split(slice(0, first), slice(first, data.n), "the first part")
    readings = data.readings.copy()
    readings[first:, 0] += wrong * data.floor[0] * np.sin(np.arange(data.n - first) / 5.0)
    few = replace(data, split=split, readings=readings)
    return fit(replace(problem, data=few), max_iterations=20)


@pytest.mark.parametrize("share", [12, 20])
def test_a_true_model_with_open_numbers_adds_noise_however_badly_it_predicts(share: int) -> None:
    made = barely_trained(share=share)
    assert made.chi2("test") > 5.0
    assert added(made) < 1.0 + 3.0 * scatter(made)
    assert added(made) > 0.7


def test_what_no_number_could_mend_adds_more_than_noise() -> None:
    made = barely_trained(wrong=1.0)
    assert added(made) > 1.0 + 3.0 * scatter(made)
    assert added(barely_trained(wrong=10.0)) > 20.0


def test_where_training_determines_everything_it_is_the_held_out_misfit() -> None:
    made = small()
    data = made.problem.data
    test = np.mean((made.residuals("test") / data.floor) ** 2, axis=0)
    assert added(made) == pytest.approx(test.max(), rel=0.05)
    whole = replace(data.split, train=slice(0, data.n), test=())
    nothing = replace(made, problem=replace(made.problem, data=replace(data, split=whole)))
    assert np.isnan(added(nothing))


def test_parts_that_cannot_be_fitted_together_add_endlessly(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def runs_away(*_: object, **__: object) -> Fit:
        raise np.linalg.LinAlgError("derivatives are not finite where the fit ended")

    monkeypatch.setattr(replication, "fit", runs_away)
    assert added(barely_trained()) == np.inf
