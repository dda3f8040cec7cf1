"""The printed numbers of the stack actuator thesis beside what they give, as a text table."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence

import numpy as np

from actuators.stack.conversions import OPERATORS, STRUCTURES, paired
from actuators.thesis import (
    FINDINGS,
    NOT_REPRODUCIBLE,
    ComparisonRow,
    constant_rows,
    error_rows,
    loop_rows,
    spacing_rows,
)
from bondgraph.simulation.simulate import simulate

WIDTH = 132
HEADINGS = ("printed", "printed set gives", "corrected gives")
STAND_IN = (
    "The measured samples of the thesis are not public. Set (6.2) reproduces the loop that the "
    "text describes and stands in for the measured 2 Hz loop: errors in the two 'gives' columns "
    "are against it, printed errors are against the samples. Every number in the 'gives' "
    "columns is computed now. Third period from the virgin state, 0 to 100 V."
)
SECTIONS = (
    ("Steady loop at 2 Hz (printed: the measured loop)", loop_rows),
    ("Other readings of the thresholds of (6.3)", spacing_rows),
    ("Errors, tables 6.3 and 6.5", error_rows),
    ("Constants", constant_rows),
)


def comparison_report() -> Iterator[str]:
    """Yield the lines of every printed value beside what it gives."""
    yield from textwrap.wrap(STAND_IN, WIDTH)
    for title, rows in SECTIONS:
        yield from ("", title, *table(rows()))
    yield from ("", *textwrap.wrap(NOT_REPRODUCIBLE, WIDTH))


def table(rows: Sequence[ComparisonRow]) -> Iterator[str]:
    """Yield the lines of an aligned table; a long remark flows on beside the rows below it.

    Parameters
    ----------
    rows : sequence of ComparisonRow
    """
    first = max(len(row.quantity) for row in rows)
    unit = max(len("unit"), *(len(row.unit) for row in rows))
    numbers = [len(h) for h in HEADINGS]
    left = first + unit + sum(numbers) + 2 * (2 + len(numbers))
    room = max(WIDTH - left, 24)

    def line(cells: Sequence[str], remark: str) -> str:
        name, in_unit, *values = cells
        shown = [v.rjust(w) for v, w in zip(values, numbers, strict=True)]
        parts = (name.ljust(first), in_unit.ljust(unit), *shown, remark)
        return "  ".join(parts).rstrip()

    yield line(("quantity", "unit", *HEADINGS), "remark")
    yield "-" * WIDTH
    waiting: list[str] = []
    for row in rows:
        if row.remark:
            yield from (line(("",) * 5, rest) for rest in waiting)
            waiting = textwrap.wrap(row.remark, room)
        values = [row.shown(v) for v in (row.printed, row.given, row.corrected)]
        yield line((row.quantity, row.unit, *values), waiting.pop(0) if waiting else "")
    yield from (line(("",) * 5, rest) for rest in waiting)


def findings_report() -> Iterator[str]:
    """Yield the lines of what a reproducer has to know, place by place."""
    first = max(len(f.where) for f in FINDINGS) + 2
    for f in FINDINGS:
        yield f"{f.where.ljust(first)}printed: {f.printed}"
        indent = " " * first
        yield from textwrap.wrap(f.finding, WIDTH, initial_indent=indent, subsequent_indent=indent)


def pairing_report() -> Iterator[str]:
    """Simulate every structure with every operator; yield how far its slow loop is off."""
    yield "Every structure with every operator: simulated slow loop less the operator it came from,"
    yield "largest difference over stroke, 2 Hz, 0 to 100 V (inertia, damping and R_e included)"
    yield "operator".ljust(22) + "".join(s.rjust(14) for s in STRUCTURES)
    for name in OPERATORS:
        found = (f"{pairing_deviation(s, name):.2g}" for s in STRUCTURES)
        yield name.ljust(22) + "".join(text.rjust(14) for text in found)


def pairing_deviation(structure: str, operator: str) -> float:
    """Return the largest difference of a paired model from its operator over one slow loop.

    Parameters
    ----------
    structure : str
        Of `actuators.stack.conversions.STRUCTURES`.
    operator : str
        Of `actuators.stack.conversions.OPERATORS`.

    Returns
    -------
    float
        Over the stroke; two periods at 2 Hz, 0 to 100 V, from the virgin state.
    """
    pure = OPERATORS[operator]()
    time = np.arange(2001) * 5e-4
    volt = 50.0 - 50.0 * np.cos(4.0 * np.pi * time)
    exact, _ = pure.run(volt)
    run = simulate(
        paired(structure, pure), time, {"V_in": volt}, accuracy=1e-6, x0="rest", hold="linear"
    )
    return float(np.abs(run["x"] - exact).max() / np.ptp(exact))
