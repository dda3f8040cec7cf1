"""A search that is stopped gives what was named before; without a step it is stopped itself."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from bondsight.cli.progress import Deadline
from identification.diagnosis.search import forward_selection
from identification.diagnosis.search.forward_selection import Halted


def step(number: int) -> Any:
    chosen = SimpleNamespace(fit=None, element=f"e{number}")
    return SimpleNamespace(kind="missing_physics", chosen=chosen)


@pytest.mark.parametrize("ends", [0, 1, 2])
def test_the_steps_before_are_kept(ends: int, monkeypatch: pytest.MonkeyPatch) -> None:
    def searched(_base: Any, _task: Any, number: int, _places: Any) -> int:
        if number == ends:
            raise KeyboardInterrupt
        return number

    monkeypatch.setattr(forward_selection, "searched", searched)
    monkeypatch.setattr(forward_selection, "decided", lambda number, task: step(number))
    monkeypatch.setattr(forward_selection, "base_of", lambda fit: fit)
    monkeypatch.setattr(forward_selection, "held_to_residual", lambda fit, given: fit)
    task: Any = SimpleNamespace(given=(), options=None)
    with pytest.raises(Halted) as stop:
        forward_selection._forward(SimpleNamespace(), task, 5)  # type: ignore[arg-type]
    assert [d.chosen.element for d in stop.value.decisions if d.chosen] == [
        f"e{i}" for i in range(ends)
    ]


def test_a_deadline_ends_the_search_and_not_what_is_written() -> None:
    said: list[str] = []
    late = Deadline(lambda text, part: said.append(text), -1.0)
    with pytest.raises(KeyboardInterrupt):
        late("searching", 0.5)
    late("writing", 0.95)
    Deadline(lambda text, part: said.append(text), None)("no limit", 0.5)
    assert said == ["searching", "writing", "no limit"]
