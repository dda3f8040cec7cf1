"""A law along a record against its own steps, one by one."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph.laws import FrictionUnderLoad, Law
from bondgraph.laws.along import along
from bondgraph.support.errors import UnusableInput
from bondgraph.support.ops import NUMPY
from tests.bondgraph.laws.test_laws import EVERY

DT = 2e-3
ALONE = {name: law for name, law in EVERY.items() if not law.watched}


@pytest.mark.parametrize("name", ALONE)
def test_the_record_is_its_steps(name: str) -> None:
    law: Law = ALONE[name]
    s = 1.4 * np.sin(np.linspace(0.3, 9.0, 40)) + 0.1
    p = [q.value for q in law.parameters("e")]
    memory, wanted = law.initial_memory(float(s[0])), []
    for i, v in enumerate(s):
        known = (*p, DT if i else 0.0) if law.timed else p
        wanted.append(float(law.deviation(NUMPY, v, memory, known)))
        memory = tuple(map(float, law.advance(NUMPY, v, memory, known)))
    size = max(1.0, float(np.abs(wanted).max()))
    np.testing.assert_allclose(along(law, s, DT, p), wanted, atol=1e-9 * size)


def test_a_law_that_reads_another_signal_has_no_course_of_its_own() -> None:
    with pytest.raises(UnusableInput, match=r"reads e_k beside its argument; .* run a graph"):
        along(FrictionUnderLoad("e_k"), np.zeros(5), DT, [1.0, 0.1, 0.1])
