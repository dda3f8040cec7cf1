"""A header ``a[g]`` of an acceleration: the gram in SI, standard gravity where it is asked for."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bondgraph import BondGraph, Da, I, One, Se
from bondgraph.signals.recording import Recording
from bondgraph.support.errors import UnusableInput
from identification.study.data import require_channels


def body() -> BondGraph:
    with BondGraph("body") as g:
        b = One("b")
        Se("F", unit="N") >> b >> I("m", 1.0, unit="kg")
        b >> Da("a", unit="m/s2")
    return g


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "logged.csv"
    rows = (f"{0.01 * k:.2f},{k % 3},{0.1 * (k % 5):.1f}" for k in range(40))
    path.write_text("t[s],F[N],a[g]\n" + "\n".join(rows) + "\n")
    return path


def test_a_gram_is_no_acceleration_and_what_was_meant_is_said(file: Path) -> None:
    with pytest.raises(UnusableInput, match=r"g is the gram: .* write a\[g0\] .*COLUMN\[g0\]"):
        require_channels(body(), Recording.read(file))


def test_a_map_may_say_that_gravity_was_meant(file: Path) -> None:
    read = Recording.read(file, map={"a": "a[g0]"})
    require_channels(body(), read)
    assert np.max(read["a"]) == pytest.approx(0.4 * 9.80665)


def test_no_other_header_is_overruled_by_a_map(file: Path) -> None:
    with pytest.raises(UnusableInput, match="make the units agree"):
        Recording.read(file, map={"a": "a[m/s2]"})
