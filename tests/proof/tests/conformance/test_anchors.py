"""The peer: what it is told, and what becomes of its replies, delays and refusals."""

from __future__ import annotations

import json
import os
import stat
import sys
from pathlib import Path

import pytest

from bondgraph.support.errors import UnusableInput
from tests.proof.conformance.anchors import (
    NotExpressible,
    describe,
    judge_bondgraphtools,
    peer_version,
)
from tests.proof.conformance.case import Case, case, cases
from tests.proof.conformance.check import REFUSED, RIGHT, UNSAID, WRONG

PEER = os.environ.get("BONDSIGHT_PEER", "")
needs_peer = pytest.mark.skipif(not PEER, reason="BONDSIGHT_PEER names no Python")


def pretender(folder: Path, reply: str, wait: float = 0.0) -> str:
    """Make a program that takes any input and gives this reply."""
    path = folder / "python"
    path.write_text(
        f"#!{sys.executable}\nimport sys, time\nsys.stdin.read()\ntime.sleep({wait})\n"
        f"sys.stdout.write({reply!r})\n"
    )
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return str(path)


RC = {
    "relations": ["dx_0 + x_0/(par_C*par_R)"],
    "states": {"x_0": ["c", "q_0"]},
    "controls": {},
}


@pytest.mark.parametrize(
    ("relation", "verdict"),
    [
        ("dx_0 + x_0/(par_C*par_R)", RIGHT),
        ("dx_0 - x_0/(par_C*par_R)", WRONG),
        ("dx_0 + x_0/(par_C*par_R) + f_3", WRONG),
        ("dx_0 + x_0.__class__", REFUSED),
        ("dx_0**2 + x_0", REFUSED),
    ],
)
def test_replies_are_judged(tmp_path: Path, relation: str, verdict: str) -> None:
    python = pretender(tmp_path, json.dumps({**RC, "relations": [relation]}))
    assert judge_bondgraphtools(case("bgj_rc"), python).verdict == verdict


@pytest.mark.parametrize("reply", ["", "no json", '{"error": "KeyError: x"}'])
def test_a_failure_of_the_peer_is_a_refusal(tmp_path: Path, reply: str) -> None:
    python = pretender(tmp_path, reply)
    assert judge_bondgraphtools(case("bgj_rc"), python).verdict == REFUSED


def test_the_time_is_limited(tmp_path: Path) -> None:
    python = pretender(tmp_path, "", wait=20.0)
    judgement = judge_bondgraphtools(case("bgj_rc"), python, limit=0.3)
    assert (judgement.verdict, judgement.reason) == (REFUSED, "no result within 0.3 s")


def test_an_accepted_impossible_graph_is_wrong(tmp_path: Path) -> None:
    python = pretender(tmp_path, '{"relations": [], "states": {}, "controls": {}}')
    c = case("gs96_two_sources_conflict")
    assert judge_bondgraphtools(c, python).verdict == WRONG


@pytest.mark.parametrize("c", cases(), ids=lambda c: c.identity)
def test_only_modulation_cannot_be_stated(c: Case) -> None:
    if any(p.type == "MSe" for p in c.parts):
        with pytest.raises(NotExpressible, match="modulated"):
            describe(c)
        assert judge_bondgraphtools(c, sys.executable).verdict == UNSAID
        return
    told = describe(c, numbers=True)
    assert len(told["components"]) == len(c.parts)
    assert "symbol" not in json.dumps(told)
    assert all(("symbol" in json.dumps(describe(c))) == bool(c.parameters) for _ in range(1))


def test_two_ports_are_turned_to_the_conventions_of_the_peer() -> None:
    told = describe(case("bgt_lc_through_tf"))
    assert told["bonds"] == [["c", None, "T", 1], ["T", 0, "l", None]]


def test_a_python_without_the_peer_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UnusableInput, match="cannot be run"):
        peer_version(str(tmp_path / "nothing"))


@needs_peer
@pytest.mark.parametrize("name", ["gs96_dc_motor_gearbox", "mtt_electrostatic_energy", "bgj_rl"])
def test_the_real_peer_is_right(name: str) -> None:
    assert peer_version(PEER) == "0.4.6"
    judgement = judge_bondgraphtools(case(name), PEER)
    assert judgement.verdict == RIGHT, judgement.reason
