"""The comparison table: every computed number against an independent computation."""

from __future__ import annotations

import pytest

from actuators.thesis import ComparisonRow, constant_rows, error_rows, loop_rows, spacing_rows
from actuators.thesis.comparison import LABELS
from actuators.thesis.report import SECTIONS, pairing_deviation, table
from bondsight.cli.main import main


def by_name(rows: tuple[ComparisonRow, ...]) -> dict[str, ComparisonRow]:
    found = {row.quantity: row for row in rows}
    assert len(found) == len(rows)
    return found


@pytest.mark.parametrize(
    ("model", "bottom", "top", "thickness", "ratio"),
    [
        ("al_janaideh", 506.8, 4914.7, 790, 16.1),
        ("ang", 475.5, 4873.2, 766, 15.7),
        ("bond_graph", 513.7, 5062, 779, 15.4),
        ("lumped", 510.9, 4511.6, 531, 11.8),
    ],
)
def test_printed_sets_give(
    model: str, bottom: float, top: float, thickness: float, ratio: float
) -> None:
    rows = by_name(loop_rows())
    label = LABELS[model]
    given = [rows[f"{label}: {q}"].given for q in ("bottom", "top", "thickness", "thickness/top")]
    assert None not in given
    b, t, thick, r = (float(v) for v in given if v is not None)
    assert 1e9 * b == pytest.approx(bottom, abs=0.06)
    assert 1e9 * t == pytest.approx(top, abs=0.3 if model == "bond_graph" else 0.06)
    assert 1e9 * thick == pytest.approx(thickness, abs=0.55)
    assert 100 * r == pytest.approx(ratio, abs=0.055)


def test_corrected_sets_give() -> None:
    rows = by_name(loop_rows())

    def corrected(quantity: str) -> float:
        value = rows[quantity].corrected
        assert value is not None
        return 1e9 * value

    assert rows["Al Janaideh (6.2): top"].corrected is None
    for label in (LABELS["ang"], LABELS["bond_graph"], LABELS["lumped"]):
        assert corrected(f"{label}: top") == pytest.approx(4900, rel=0.03)
    assert corrected(f"{LABELS['ang']}: thickness") == pytest.approx(770, rel=0.03)
    assert corrected(f"{LABELS['bond_graph']}: thickness") == pytest.approx(770, rel=0.03)
    # T mends the stroke of the lumped model, not its thickness; other elements do
    assert corrected(f"{LABELS['lumped']}: thickness") < 0.8 * 770
    assert corrected("lumped, 10 other elements: top") == pytest.approx(4914.7, abs=0.06)
    assert corrected("lumped, 10 other elements: thickness") == pytest.approx(790, abs=0.5)


@pytest.mark.parametrize(
    ("reading", "bottom", "top", "thickness"),
    [
        ("r_i = i 50/10 V", 580, 4765, 728),
        ("r_i = i 50/11 V", 521, 4824, 749),
        ("r_i = (i + 1) 50/12 V", 700, 4645, 1064),
    ],
)
def test_wrong_spacings(reading: str, bottom: float, top: float, thickness: float) -> None:
    rows = by_name(spacing_rows())
    for quantity, expected in (("bottom", bottom), ("top", top), ("thickness", thickness)):
        given = rows[f"Ang (6.3), {reading}: {quantity}"].given
        assert given is not None
        assert 1e9 * given == pytest.approx(expected, abs=1.0)


def test_errors_of_the_printed_sets() -> None:
    rows = by_name(error_rows())

    def given(quantity: str) -> float:
        value = rows[quantity].given
        assert value is not None
        return 1e9 * value

    ang, lumped = LABELS["ang"], LABELS["lumped"]
    assert given(f"{ang}: max, sine") == pytest.approx(83, abs=0.5)
    assert given(f"{ang}: rms, sine") == pytest.approx(42, abs=0.5)
    assert given(f"{ang}: max, sine, no offset") == pytest.approx(45, abs=0.5)
    assert given(f"{ang}: rms, sine, no offset") == pytest.approx(16, abs=0.5)
    assert given(f"{lumped}: max, sine") == pytest.approx(422, abs=0.5)
    assert given(f"{lumped}: rms, sine") == pytest.approx(260, abs=0.5)
    assert given(f"{lumped}: max, sine, no offset") == pytest.approx(222, abs=0.5)
    assert given(f"{lumped}: rms, sine, no offset") == pytest.approx(167, abs=0.5)
    # one path, so one maximum; another weight along it, so another rms
    for label in (ang, lumped, LABELS["bond_graph"]):
        sine, triangle = given(f"{label}: max, sine"), given(f"{label}: max, triangle")
        assert sine == pytest.approx(triangle, rel=2e-3)
        assert given(f"{label}: rms, sine") != pytest.approx(
            given(f"{label}: rms, triangle"), rel=0.01
        )


def test_errors_after_the_refit() -> None:
    """Size of table 6.5 once T is refitted: near 150 / 71 nm for the lumped model."""
    rows = by_name(error_rows())
    for key, most, rms in (("lumped", 150e-9, 71e-9), ("bond_graph", 95.51e-9, 29.59e-9)):
        found = [rows[f"{LABELS[key]}: {name}, sine"].corrected for name in ("max", "rms")]
        assert found == pytest.approx([most, rms], rel=0.13)
    for row in rows.values():
        if row.given is not None and row.corrected is not None:
            assert row.corrected < row.given
    assert rows["Al Janaideh (6.2): max, sine"].given is None  # it stands in for the data


def test_constants() -> None:
    rows = by_name(constant_rows())

    def both(quantity: str) -> tuple[float | None, float | None]:
        row = rows[quantity]
        return tuple(  # type: ignore[return-value]
            None if v is None else float(row.shown(v)) for v in (row.given, row.corrected)
        )

    expected: dict[str, tuple[float | None, float | None, float]] = {
        "sum of v_i, by (5.11)": (11.8, 16.70, 0.05),
        "V_h that gives the printed top": (9.5, None, 0.05),
        "capacitance of the lumped model": (None, 1.309, 5e-4),
        "last threshold of (6.2)": (52.8, 43.6, 0.05),
        "number of weights of (6.3)": (None, 13, 0),
        "remanence after the signal (6.1)": (132, None, 0.5),
        "secant capacitance": (13.9, 1500, 2),
        "charge at 100 V, bond graph": (1.4, 150, 0.2),
        "time constant R_e C": (0.070, 7.5, 0.01),
        "short-circuit stiffness": (5.3, 58.9, 0.05),
        "resonance driven by voltage, 16 g": (2.9, 9.7, 0.05),
        "resonance": (10.1, 17.6, 0.05),
        "current per frequency and stroke": (10, None, 1e-9),
        "T as k times the end slope of (6.2)": (3.52, None, 0.005),
    }
    for name, (given, corrected, tolerance) in expected.items():
        found = both(name)
        for value, wanted in zip(found, (given, corrected), strict=True):
            assert (value is None) == (wanted is None), name
            assert value is None or value == pytest.approx(wanted, abs=tolerance), name
    top = both("charge at 100 V, lumped")
    assert top[0] == pytest.approx(140.8, abs=0.06)
    assert both("V_h at 100 V, lumped")[0] == pytest.approx(16.69, abs=5e-3)
    half = rows["half range behind sec 6.5"]
    assert half.given == pytest.approx(2.757 * 18, abs=0.02)


def test_table_is_aligned_and_loses_nothing() -> None:
    for _, rows in SECTIONS:
        made = rows()
        lines = list(table(made))
        assert all(len(line) <= 132 for line in lines)
        column = lines[0].index("remark")
        text = " ".join(line[column:].strip() for line in lines[2:])
        words = " ".join(text.split())
        for row in made:
            assert " ".join(row.remark.split()) in words
        for line, row in zip([x for x in lines[2:] if x[:column].strip()], made, strict=True):
            cells = line[:column].removeprefix(row.quantity).split()
            values = [row.shown(v) for v in (row.printed, row.given, row.corrected)]
            assert cells[-3:] == values


def test_command_prints(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["thesis"]) == 0
    out = " ".join(capsys.readouterr().out.split())
    for words in ("stands in for the measured", "What cannot be reproduced", "4511.6", "167.31"):
        assert words in out
    assert out.isascii()


def test_command_prints_inconsistencies(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["thesis", "--inconsistencies"]) == 0
    out = capsys.readouterr().out
    assert "E_2 = -F T/l" in out
    assert all(len(line) <= 132 for line in out.splitlines())
    assert "What cannot be reproduced" not in out


def test_pairing_deviation() -> None:
    assert pairing_deviation("lumped", "maxwell") < 2e-5
    assert pairing_deviation("pure", "ang") < 1e-14
