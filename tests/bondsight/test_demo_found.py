"""A demo whose delay bends the model so far that the screening puts it in twelfth place."""

from __future__ import annotations

from pathlib import Path

import pytest

from bondsight.cli.main import main


@pytest.mark.long
def test_a_delay_that_bends_the_model_is_found(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["demo", "--seed", "66486673", "--out", str(tmp_path), "--jobs", "1"]) == 0
    said = capsys.readouterr().out
    assert "weak delay at i" in said
    assert "the verdict is: right" in said
