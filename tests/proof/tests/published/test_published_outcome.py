"""Outcomes, hashes, the printed table and the command; no data."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
import pytest

from bondgraph.signals.recording import Recording
from bondgraph.support.errors import UnknownName, UnusableInput
from identification.datasets.places import CACHE_VARIABLE
from tests.proof.published.catalogue import PROTOCOLS, run_protocol
from tests.proof.published.command import add_published_command
from tests.proof.published.outcome import Compared, Outcome, Reached, split_hash
from tests.proof.published.staging import joined, scaled, settled
from tests.proof.published.table import table


@pytest.fixture(autouse=True)
def no_downloads(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path / "cache"))


def outcome(value: float = 0.2, fitted: float = 95.0) -> Outcome:
    return Outcome(
        "box", "A box", True, "train: a; test: b", "0123456789ab", 50,
        (Reached("arrow", value, "mV", 0.3), Reached("free", 9.0, "mm")),
        (Compared("M", fitted, "kg", 95.1, 0.03), Compared("c", 1.0, "1", 2.0)),
        values={"M": fitted}, seconds=1.2, notes=("a remark",),
    )  # fmt: skip


def run(*arguments: str) -> int:
    parser = argparse.ArgumentParser()
    add_published_command(parser.add_subparsers())
    options = parser.parse_args(["published", *arguments])
    return int(options.run(options))


def test_reached_is_judged_by_every_target() -> None:
    assert outcome().reached
    assert not outcome(value=0.31).reached
    assert not outcome(fitted=90.0).reached
    assert outcome().error("free").reached is None
    assert outcome().parameters[1].distance == -0.5
    with pytest.raises(UnknownName, match="arrow"):
        outcome().error("arow")


def test_table_says_unit_split_init_and_kind() -> None:
    text = table([outcome(value=0.31)])
    for words in (
        "official split; split 0123456789ab, init 50",
        "0.31 mV",
        "free-run simulation RMSE  target 0.3 mV  NOT reached",
        "published 95.1 (-0.1 %), 3 % allowed  reached",
        "note: a remark",
    ):
        assert words in text
    assert all(line == line.rstrip() for line in text.splitlines())


def test_json_has_everything() -> None:
    made = json.loads(json.dumps(outcome().to_dict(), allow_nan=False))
    assert made["kind"] == "free-run simulation"
    assert set(made["errors"][0]) == {"name", "rmse", "unit", "target", "reached"}
    assert made["errors"][0]["rmse"] == 0.2
    assert made["reached"] is True


def test_hash_changes_with_the_split() -> None:
    u = np.arange(10.0)
    whole = split_hash(("train", [u[:6]]), ("test", [u[6:]]))
    assert len(whole) == 12
    assert whole == split_hash(("train", [u[:6].copy()]), ("test", [u[6:]]))
    assert whole != split_hash(("train", [u[:5]]), ("test", [u[5:]]))
    assert whole != split_hash(("train", [1e3 * u[:6]]), ("test", [u[6:]]))


def test_records_repeat_and_join() -> None:
    one = Recording.from_arrays("r", {"u[V]": [1.0, 2.0, 3.0], "y[V]": [4.0, 5.0, 6.0]}, fs=10.0)
    twice = settled(one)
    assert twice["u"].tolist() == [1, 2, 3, 1, 2, 3]
    assert twice.dt == pytest.approx(0.1)
    both = joined(twice.slice(0, 4), twice.slice(4, 6))
    assert both["y"].tolist() == twice["y"].tolist()
    assert np.allclose(both.time, twice.time)


def test_progress_fills_its_part() -> None:
    seen: list[float] = []
    say = scaled(lambda text, fraction: seen.append(fraction), 0.2, 0.6)
    assert say is not None
    say("", 0.0)
    say("", 1.0)
    assert seen == pytest.approx([0.2, 0.6])
    assert scaled(None, 0.0, 1.0) is None


def test_unknown_protocol_is_one_line() -> None:
    with pytest.raises(UnknownName, match="Did you mean 'silverbox'"):
        run_protocol("silverbx")


@pytest.mark.parametrize("name", ["silverbox", "emps"])
def test_absent_recording_says_where_it_is(name: str, tmp_path: Path) -> None:
    with pytest.raises(UnusableInput, match=r"get .* @ "):
        run_protocol(name, tmp_path)


def test_command_lists_and_refuses(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert run("--list") == 0
    assert capsys.readouterr().out.split() == list(PROTOCOLS)
    with pytest.raises(UnusableInput, match="above 0"):
        run("--share", "0")
    with pytest.raises(UnknownName):
        run("nothing")
    assert run("--folder", str(tmp_path)) == 1  # nothing there, nothing reached
    assert "silverbox: skipped" in capsys.readouterr().err
