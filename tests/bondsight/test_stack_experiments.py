"""The stack experiments print what they compute and draw it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from bondsight.cli import stack_clocks
from bondsight.cli.main import main


def drawn(path: Path) -> bool:
    return path.read_text(encoding="utf-8").startswith("<svg")


def test_mechanical(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert main(["stack", "mechanical", "--out", str(tmp_path / "loading.svg")]) == 0
    text = capsys.readouterr().out
    assert drawn(tmp_path / "loading.svg")
    left = [float(v) for v in re.findall(r"then eq\. \(6\.1\) +([\d.]+)   by", text)]
    assert left == pytest.approx([132.2, 140.5], abs=1.0)
    bounds = re.findall(r"step .*?: +([\d.]+), bound +([\d.]+)", text)
    assert len(bounds) == 3
    assert all(float(a) < float(b) for a, b in bounds)
    known = re.search(r"k slope = ([\d.]+) N/V \(-(\S+) %\)", text)
    assert known is not None
    assert float(known[1]) == pytest.approx(3.52, rel=0.02)


def test_charge_drive(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert main(["stack", "charge", "--out", str(tmp_path / "charge.svg")]) == 0
    text = capsys.readouterr().out
    assert drawn(tmp_path / "charge.svg")
    rows = re.findall(r"(free|spring|slipping).* ([\d.]+) % +[\d.e-]+ nm, ([\d.]+) %", text)
    assert len(rows) == 6
    for load, volt, charge in rows:
        assert float(volt) > 12.0
        assert (float(charge) < 0.01) is (load != "slipping")
    assert len(re.findall(r"0\.03\d\d um/s, \(x/q\)", text)) == 2
    assert text.count("gain 0.7071 linear") == 3


@pytest.mark.long
@pytest.mark.parametrize("whole", [False, True])
def test_clock_skew(
    whole: bool, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    clocks = {"equal clocks": 0.0, "100 ppm": 100.0, "-100 ppm": -100.0}
    if not whole:  # one constant clock, one that drifts, and no frequency in the middle
        for other in ("equal clocks", "-100 ppm"):
            del clocks[other]
            monkeypatch.delitem(stack_clocks.CLOCKS, other)
        monkeypatch.setattr(stack_clocks, "FREQUENCIES", (2.0, 100.0))
    frequencies = 3 if whole else 2
    truths = 2 * [p for p in (*clocks.values(), -60.0) for _ in range(frequencies)]
    assert main(["stack", "clocks", "--out", str(tmp_path / "clock.svg")]) == 0
    text = capsys.readouterr().out
    assert drawn(tmp_path / "clock.svg")
    rows = re.findall(r"true +(\S+), seen +(\S+) .*corrected +(\S+); ppm", text)
    assert len(rows) == len(truths)
    for true, _, corrected in rows:
        assert float(corrected) == pytest.approx(float(true), abs=8.0)
    assert max(abs(float(s) - float(t)) for t, s, _ in rows) > 2000.0
    ratios = re.findall(r"corrected +\S+; ppm (-?[\d.]+) \+- ([\d.]+)", text)
    for (found, half), truth in zip(ratios, truths, strict=True):
        # printed to two digits
        assert abs(float(found) - truth) <= 2.0 * float(half) + 0.01
