"""The sub-command `recordings`: lists, tells, refuses to fetch without a checksum."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import pytest

from bondgraph.support.errors import UnknownName, UnusableInput
from bondsight.cli.recordings import add_recordings_command
from identification.datasets.places import CACHE_VARIABLE, FOLDER_VARIABLE


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path / "cache"))
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path))
    return tmp_path


def run(*arguments: str) -> int:
    parser = argparse.ArgumentParser()
    add_recordings_command(parser.add_subparsers())
    options = parser.parse_args(["recordings", *arguments])
    return int(options.run(options))


def test_list_and_details(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run() == 0
    assert "steering_mirror        absent" in capsys.readouterr().out
    assert run("coupled_drives") == 0
    assert "absent:   put ced_prbs.csv" in capsys.readouterr().out
    assert run("silverbox") == 0
    asked = "bondsight recordings silverbox --fetch --sha256 SNLS80mV.mat=HEX; its checksum is not"
    assert asked in capsys.readouterr().out
    place = folder / "coupled-electric-drives"
    place.mkdir()
    rows = "".join(f"{i / 50:.2f},1,2,3,4,5,6\n" for i in np.arange(500))
    (place / "ced_prbs.csv").write_text("t_s,u1_V,y1,u2_V,y2,u3_V,y3\n" + rows)
    assert run("coupled_drives", "--fetch") == 0
    out = capsys.readouterr().out
    assert "test/0.5V" in out
    assert "100 samples at 50 Hz from ced_prbs.csv" in out


def test_refusals() -> None:
    with pytest.raises(UnusableInput, match="needs the name"):
        run("--fetch")
    with pytest.raises(UnusableInput, match="is not FILE=HEX"):
        run("silverbox", "--fetch", "--sha256", "SNLS80mV.mat")
    with pytest.raises(UnusableInput, match=r"no checksum of SNLS80mV\.mat is known"):
        run("silverbox", "--fetch")
    with pytest.raises(UnknownName, match="Did you mean 'emps'"):
        run("epms")
