"""Numbers of a repair come from sub-steps that are enough; where they are not, it is said."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph.equations.derivation import equations
from bondgraph.laws import Coulomb
from bondgraph.signals.recording import Recording
from bondgraph.simulation.exact_run import run_record
from bondgraph.simulation.lure import lure_of
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.diagnosis.verdict import in_words
from identification.estimation import enough_steps
from identification.estimation.estimate import estimate
from tests.identification.diagnosis.dragged_spring import TRUE, diagnosed
from tests.identification.diagnosis.rubbing_spring import FORCE, T, U
from tests.spring import spring


def test_no_number_of_a_repair_is_off_by_too_few_sub_steps() -> None:
    found = diagnosed()
    assert [s.chosen.label for s in found.findings if s.chosen] == ["quadratic_drag at d"]
    assert found.repaired is not None
    for e in found.repaired.estimates:
        error = (e.ci95[1] - e.ci95[0]) / 3.92
        assert abs(e.value - TRUE[e.name]) < 2.5 * error, e.name
    # its study carries them on
    assert found.study.n_sub == found.repaired.problem.n_sub
    assert not any("sub-steps" in n or "n_sub" in n for n in estimate(found.study).notes)
    assert "sub-steps" not in in_words(found)


def test_where_enough_sub_steps_would_take_too_long_it_is_said(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(enough_steps, "MOST", 1)
    found = diagnosed()
    (said,) = [n for n in found.notes if "sub-steps a sample" in n]
    assert "its interval is too narrow" in said
    assert said in in_words(found)


@pytest.mark.long
def test_steps_in_which_a_recording_was_simulated_are_kept() -> None:
    """What a tool has simulated in steps of a sample is no motion: those steps explain it best."""
    made = lure_of(equations(spring().with_element("d", law=Coulomb(FORCE))))
    run = run_record(made, made.nominal(), U[:, None], float(T[1] - T[0]), np.zeros(made.n_x))
    x = run.y[:, made.model.output_names.index("x")]
    x = x + 1e-5 * np.random.default_rng(1).standard_normal(T.size)
    recorded = Recording.from_arrays("steps", {"t[s]": T, "F[N]": U, "x[m]": x})
    options = DiagnosisOptions(jobs=1, effects=1, keep=4, more=0)
    found = diagnose(spring(), recorded, options=options)
    assert found.repaired is not None
    (said,) = [n for n in found.notes if "sub-steps a sample" in n]
    assert "fit worse" in said
    assert said.endswith(f"the numbers are those of {found.repaired.problem.n_sub}")
