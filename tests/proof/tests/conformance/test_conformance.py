"""Every published case, derived by Bondsight and judged."""

from __future__ import annotations

import pytest

from tests.proof.conformance.case import Case, cases
from tests.proof.conformance.check import RIGHT
from tests.proof.conformance.ours import judge_bondsight

# what must have been compared whenever the source or the brute force gives it
COMPARED = {
    "order": "order",
    "state_equations": "state equations",
    "tf": "transfer functions",
    "eigenvalues": "eigenvalues",
    "final": "final value",
    "derivative_causality": "derivative causality",
    "algebraic_loops": "algebraic loops",
    "conflict": "conflict",
}


@pytest.mark.parametrize("case", cases(), ids=lambda c: c.identity)
def test_the_published_case_comes_out_right(case: Case) -> None:
    judgement = judge_bondsight(case)
    assert judgement.verdict == RIGHT, judgement.reason
    assert {COMPARED[f] for f in case.expected} <= set(judgement.checked)
