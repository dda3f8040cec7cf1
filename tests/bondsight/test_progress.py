"""Progress: a bar in a terminal, a line now and then in a log, nothing where that is asked for."""

from __future__ import annotations

import pytest

from bondgraph.support.notice import Notice
from bondsight.cli import progress
from bondsight.cli.progress import PAUSE, Bar


@pytest.mark.parametrize("quiet", [False, True])
def test_a_log_gets_a_line_now_and_then(
    quiet: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    clock = iter([0.0, 1.0, PAUSE + 1.0, PAUSE + 2.0, 3 * PAUSE])
    monkeypatch.setattr(progress, "monotonic", lambda: next(clock))
    with Bar(quiet) as bar:
        for k, text in enumerate(("a", "b", "c", "d")):
            bar(text, k / 4)
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err == ("" if quiet else f"{PAUSE + 1:.0f} s: b\n{3 * PAUSE:.0f} s: d\n")


@pytest.mark.parametrize("quiet", [False, True])
def test_a_notice_is_told_at_once(quiet: bool, capsys: pytest.CaptureFixture[str]) -> None:
    with Bar(quiet) as bar:
        bar("fitting", 0.1)
        bar(Notice("check the unit of T first: all values are a thousand times off"), 0.1)
        bar("searching", 0.2)
        bar(Notice("check the unit of T first: all values are a thousand times off"), 0.1)
    line = "suspect: check the unit of T first: all values are a thousand times off\n"
    assert capsys.readouterr().err == ("" if quiet else line)
