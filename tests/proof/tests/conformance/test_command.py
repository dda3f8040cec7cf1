"""The table of verdicts."""

from __future__ import annotations

import argparse
import json

import pytest

from bondgraph.support.errors import UnknownName, UnusableInput
from tests.proof.conformance.check import REFUSED, RIGHT, WRONG, Judgement
from tests.proof.conformance.command import Column, add_conformance_command, table


def run(*arguments: str) -> int:
    parser = argparse.ArgumentParser()
    add_conformance_command(parser.add_subparsers())
    options = parser.parse_args(["conformance", *arguments])
    return int(options.run(options))


def test_one_case_is_judged_and_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("--case", "mtt_rc2") == 0
    said = capsys.readouterr().out
    assert "not right: none" in said
    assert said.splitlines()[1].split() == ["right", "1"]


def test_json_names_the_source_and_what_it_states(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("--case", "mtt_rc2", "--json") == 0
    said = json.loads(capsys.readouterr().out)
    assert said["cases"]["mtt_rc2"]["published"] == ["order", "state_equations", "tf"]
    assert said["tools"][0]["verdicts"]["right"] == 1
    assert "transfer functions" in said["tools"][0]["cases"][0]["checked"]


def test_what_is_not_right_is_listed_with_its_reason() -> None:
    judgements = (
        Judgement("a", RIGHT),
        Judgement("b", WRONG, "e_3 is undefined"),
        Judgement("c", REFUSED, "no result within 30 s"),
    )
    said = table([Column("tool", judgements)]).splitlines()
    assert [line.split()[-1] for line in said[1:5]] == ["1", "1", "1", "0"]
    assert said[-3:] == [
        "tool, not right: 2",
        "  b: silently wrong: e_3 is undefined",
        "  c: refused: no result within 30 s",
    ]


def test_a_typo_and_a_missing_peer_are_said_plainly() -> None:
    with pytest.raises(UnknownName, match="mtt_rc2"):
        run("--case", "mtt_rc")
    with pytest.raises(UnusableInput, match="cannot be run"):
        run("--case", "mtt_rc2", "--peer", "no-such-python")
