"""The command that prints the numbers of the ultrasonic actuator."""

from __future__ import annotations

from pathlib import Path

import pytest

from actuators.ultrasonic.figures import TOPICS
from bondsight.cli.main import main


def test_prints_numbers_and_writes_figures(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "new" / "folder"
    assert main(["ultrasonic", "driver", "wires", "--out", str(folder)]) == 0
    said = capsys.readouterr().out
    assert "ratio 2.000" in said
    assert "0.100 ms longer" in said
    assert "120.0 Vpp, 42.43 V rms" in said
    assert "closed_loop" not in said
    for t in ("driver", "wires"):
        assert (folder / f"ultrasonic_{t}.png").read_bytes()[1:4] == b"PNG"


def test_characteristic(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["ultrasonic", "characteristic", "--out", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert "speed   500.0 mm/s, F/b   500.0 mm/s" in said
    assert "not digitised" in said


def test_refusals(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["ultrasonic", "openloop", "--out", str(tmp_path)]) == 2
    assert "'open_loop'" in capsys.readouterr().err
    file = tmp_path / "file"
    file.write_text("x")
    assert main(["ultrasonic", "--out", str(file)]) == 2
    assert "is a file" in capsys.readouterr().err
    assert set(TOPICS) >= {"open_loop", "closed_loop", "resonance"}
