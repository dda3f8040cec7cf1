"""A misspelled argument of the front door is told with the nearest that there is."""

from __future__ import annotations

import inspect
import pickle
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest

import bondsight
from bondgraph.support.errors import BondsightError
from bondsight import C, DiagnosisOptions, R, Recording, Study, Vary, diagnose, estimate
from bondsight.cli.main import main

PLAIN = {"BondGraph", "BondsightError", "displacement", "Known", "LogNormal", "Normal"}
"""Without options, or with two that are seldom named."""


def test_all_of_the_front_door_offer_a_name() -> None:
    for name in set(dir(bondsight)) - PLAIN - {"Recording"}:
        if name.startswith("__"):
            continue
        with pytest.raises(BondsightError, match=f"{name}: no argument 'nameless_'.* Known: ") as e:
            getattr(bondsight, name)(nameless_=1)
        assert isinstance(e.value, TypeError)


@pytest.mark.parametrize(
    ("called", "options", "said"),
    [
        (diagnose, {"tim": 60}, "diagnose: no argument 'tim'. Did you mean 'time'"),
        (estimate, {"max_iteration": 3}, "Did you mean 'max_iterations'"),
        (Study, {"nuisance": None}, "Did you mean 'nuisances'"),
        (Vary, {"low": 1.0}, "Vary: no argument 'low'"),
        (partial(replace, Vary("k")), {"uper": 1.0}, "Did you mean 'upper'"),
        (DiagnosisOptions, {"effect": 1}, "Did you mean 'effects'"),
        (Recording.read, {"maps": {}}, "read: no argument 'maps'. Did you mean 'map'"),
        (R, {"valeu": 1.0}, "R: no argument 'valeu'. Did you mean 'value'"),
        (C, {"stifness": 1.0}, "Did you mean 'stiffness'"),
    ],
)
def test_the_nearest_is_told(called: Any, options: dict[str, Any], said: str) -> None:
    with pytest.raises(TypeError) as refused:
        called(**options)
    assert said in str(refused.value)
    assert "kind" not in str(refused.value)


def test_nothing_else_changes() -> None:
    assert "time" in inspect.signature(diagnose).parameters
    assert "free" in inspect.signature(Study).parameters
    assert list(inspect.signature(R).parameters)[:3] == ["name", "value", "unit"]
    assert pickle.loads(pickle.dumps(diagnose)) is diagnose
    assert pickle.loads(pickle.dumps(R("d", 1.0))) == R("d", 1.0)


def test_at_the_shell_a_model_says_it_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "rig.py"
    file.write_text(
        "from bondsight import BondGraph, R\ndef model():\n    with BondGraph('rig') as g:\n"
        "        R('d', valeu=1.0)\n    return g\n"
    )
    assert main(["check", str(file)]) == 2
    line = capsys.readouterr().err
    assert "Did you mean 'value'" in line
    assert line.count("\n") == 1
