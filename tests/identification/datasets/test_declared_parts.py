"""What the catalogue declares: samples, splits, names; a change of any of them changes results."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from bondgraph.signals.recording import Recording
from bondgraph.support.errors import UnusableInput
from identification.datasets import KNOWN, SETS, SetPart

LAST_THIRD = [("train/first", "", 0, Fraction(2, 3)), ("test/last", "", Fraction(2, 3), None)]
HALVES = [("train/first", "", 0, 500), ("test/last", "", 500, None)]
SPANS: dict[str, list[tuple[Any, ...]]] = {
    "silverbox": [
        ("train/multisine", "", 40_650, 105_712), ("test/multisine", "", 105_712, 127_400),
        ("test/arrow_full", "", 100, 40_575), ("test/arrow_no_extrapolation", "", 100, 32_100),
    ],
    "wiener_hammerstein": [
        ("train/noise", "", 5200, 105_200), ("test/noise", "", 105_200, 184_000),
    ],
    "bouc_wen": [
        ("train/multisine", "train_multisine", 0, None),
        ("test/multisine", "test_multisine", 0, None),
        ("test/sinesweep", "test_sinesweep", 0, None),
    ],
    "coupled_drives": [
        (f"{side}/{level}", level, start, stop)
        for level in ("1V", "1.5V", "0.5V")
        for side, start, stop in (("train", 0, 400), ("test", 400, 500))
    ],
    "emps": [("train/record", "", 0, None), ("test/pulses", "pulses", 0, None)],
    "f16": [
        ("train/periods_2_to_5", "", 8192, 40_960), ("test/periods_6_to_9", "", 40_960, 73_728),
    ],
    "piezo_actuator": [("train/periods", "", 0, None), ("test/last_periods", "", 0, None)],
    "pendulum": [
        ("train/small_swing", "small_swing", 0, None),
        ("test/large_swing", "large_swing", 0, None),
    ],
    "mr_damper": [("train/first", "", 0, 2000), ("test/last", "", 2000, None)],
    "hair_dryer": HALVES,
    "ball_and_beam": HALVES,
    "piezo_beam": LAST_THIRD,
    "rack_and_pinion": LAST_THIRD,
    "flexible_arm": LAST_THIRD,
}  # fmt: skip
WHOLE = {
    "pnzt_creep": {"train/record1_60s", "train/record3_105s"},
    "pneumatic_cylinder": {"train/O_ring_1bar", "train/O_ring_3bar", "train/O_ring_7bar"},
    "friction_damper": {
        "train/harmonic_0p5Hz_1in_70lb", "train/harmonic_0p25Hz_1p5in_36lb",
        "train/harmonic_0p5Hz_1in_30lb", "train/harmonic_1Hz_0p5in_36lb",
    },
    "motoshield": {"train/board1"},
    "hobby_servo": {f"train/rollout_{i:02d}" for i in range(96) if i % 3},
    "tclab": {"train/open_loop_prbs", "train/closed_loop_setpoints"},
    "steering_mirror": {
        f"train/{level}_{i}" for level in ("100mV", "200mV", "300mV") for i in range(1, 7)
    },
}  # fmt: skip
"""Sets of whole records: those that train."""


@pytest.mark.parametrize("name", SPANS)
def test_samples_of_parts(name: str) -> None:
    parts = SETS[name].parts
    assert [(p.name, p.record, p.start, p.stop) for p in parts if p.side] == SPANS[name]


def test_sets_of_whole_records() -> None:
    assert SETS.keys() - SPANS.keys() == WHOLE.keys()
    for name, train in WHOLE.items():
        parts = SETS[name].parts
        assert {p.name for p in parts if p.side == "train"} == train
        assert all((p.start, p.stop, p.held) == (0, None, 0.0) for p in parts)
    assert [len(SETS[n].parts) for n in WHOLE] == [14, 5, 6, 2, 96, 3, 27]


def test_parts_where_the_files_hold_less() -> None:
    own = {n: s.otherwise for n, s in SETS.items() if s.otherwise}
    assert own.keys() == {"emps", "steering_mirror"}
    spans = [(p.name, p.start, p.stop) for p in own["emps"]]
    cut = Fraction(2, 3)
    assert spans == [("train/first", 0, cut), ("test/last_third", cut, None)]
    levels = ("100mV", "200mV", "300mV")
    train = [f"train/{level}_{i}" for level in levels for i in (1, 2, 3)]
    mirror = [p.name for p in own["steering_mirror"]]
    assert mirror == [*train, *(f"test/{level}" for level in levels)]


def test_splits_of_known_recordings() -> None:
    third = 1.0 / 3.0
    found = {}
    for name, known in KNOWN.items():
        p = known.part
        found[name] = (known.set.name, p.record, p.start, p.stop, p.held, p.drive)
    assert found == {
        "silverbox": ("silverbox", "whole", 40_650, 127_400, 0.25, None),
        "silverbox/arrow": ("silverbox", "whole", 0, 40_400, third, None),
        "emps": ("emps", "", 0, None, third, None),
        "hair_dryer": ("hair_dryer", "", 0, None, third, None),
        "piezo-actuator-sine": ("piezo_actuator", "", 0, None, third, "V"),
    }


@pytest.mark.parametrize("name", SETS)
def test_entries_are_whole(name: str) -> None:
    entry = SETS[name]
    for parts in (entry.parts, entry.otherwise):
        assert len({p.name for p in parts}) == len(parts)
        for part in parts:
            assert part.side in ("train", "test", "")
            assert part.side or (0.0 < part.held < 1.0 and part.called)
    for layout in entry.layouts:
        assert entry.reader or all({*c.plan} >= {*entry.outputs} for c in layout)
        assert len({c.record for c in layout}) == len(layout) or entry.reader


def test_names_are_unique() -> None:
    names = [n for e in SETS.values() for n in (e.name, *e.aliases)]
    assert len(set(names)) == len(names)
    called = [n for called, known in KNOWN.items() for n in (called, *known.aliases)]
    assert len(set(called)) == len(called)


@pytest.mark.parametrize("n", [9, 10, 11])
def test_shares_and_sides_are_cut(n: int) -> None:
    y = np.arange(float(n))
    record = Recording("r", y, {"y": y}, {"y": "m"})
    cut = [p.cut({"": record}) for p in SETS["flexible_arm"].parts]
    assert [r.n for r in cut] == [n - n // 3, n // 3]
    assert np.array_equal(np.concatenate([r["y"] for r in cut]), y)
    with pytest.raises(UnusableInput, match=f"r: {n} samples, 12 are needed"):
        SetPart("train/first", stop=12).cut({"": record})
