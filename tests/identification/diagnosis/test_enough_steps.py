"""Numbers of a repair come from sub-steps that are enough; where they are not, it is said."""

from __future__ import annotations

import pytest

from identification.diagnosis.verdict import in_words
from identification.estimation import enough_steps
from identification.estimation.estimate import estimate
from tests.identification.diagnosis import rubbing_spring
from tests.identification.diagnosis.dragged_spring import TRUE, diagnosed


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


def test_steps_in_which_a_recording_was_simulated_are_kept() -> None:
    found = rubbing_spring.diagnosed()  # simulated in the steps of its samples
    assert found.repaired is not None
    (said,) = [n for n in found.notes if "sub-steps a sample" in n]
    assert "fit worse" in said
    assert said.endswith(f"the numbers are those of {found.repaired.problem.n_sub}")
