"""A delay of the current, which bends the model of the stack and moves nothing else."""

from __future__ import annotations

from pathlib import Path

import pytest

from bondsight.cli.demonstration import Wish, conceal, run

SEED = 8


@pytest.mark.long
def test_a_delay_that_bends_the_model_is_found(tmp_path: Path) -> None:
    made = conceal(SEED, Wish("stack", "delay"), tmp_path / "recording.csv")
    outcome = made.opened(run(made, 1, None))
    assert outcome.truth.startswith("delay at i, ")
    assert outcome.result == "right"
