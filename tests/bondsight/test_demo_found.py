"""A draw of the stack bench whose delay bends the model: the screening puts it in twelfth place."""

from __future__ import annotations

from pathlib import Path

import pytest

from actuators.models.catalogue import stack_with_payload
from bondgraph import Recording
from bondsight.cli.judged import describe_bench, judge, on_stack_bench
from hardware.simulators import draw_truth, record
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.search.candidates import DiagnosisOptions

SEED = 66486673


@pytest.mark.long
def test_a_delay_that_bends_the_model_is_found(tmp_path: Path) -> None:
    truth, path = draw_truth(SEED), tmp_path / "recording.csv"
    record(truth, SEED).write_csv(path)
    found = diagnose(
        stack_with_payload(),
        Recording.read(path, map={"V_in": "V", "x": "x", "i": "i"}),
        options=DiagnosisOptions(jobs=1),
        seed=SEED,
    )
    assert describe_bench(truth) == "weak delay at i"
    assert judge(on_stack_bench(truth), found).result == "right"
