"""The loops and model errors of chapter 6, computed: every number here but the printed ones.

The errors are against set (6.2), which stands in for the measured samples; they are not public.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

from actuators.stack.conversions import (
    Pure,
    lumped_law,
    maxwell_elements,
    plus_linear,
    pure_from_lumped,
)
from actuators.thesis.operators import ang_with_spacing
from actuators.thesis.refits import (
    bond_graph_operator,
    lumped_constants,
    lumped_operator,
    refit_ang,
    refit_bond_graph,
    refit_lumped,
    stand_in,
)
from actuators.thesis.rows import ComparisonRow
from actuators.thesis.steady import SteadyLoop, misfit, sine, steady_loop, triangle
from actuators.thesis.tables import ERRORS, MEASURED_LOOP
from actuators.thesis.values import named
from bondgraph.hysteresis import Ang, PrandtlIshlinskii
from bondgraph.laws import Hysteretic

LABELS: Mapping[str, str] = {
    "al_janaideh": "Al Janaideh (6.2)",
    "ang": "Ang (6.3)",
    "bond_graph": "bond graph + Ang (tab 6.2, sec 6.5)",
    "lumped": "lumped + Maxwell (tab 6.1, 6.4)",
}

QUANTITIES = ("bottom", "top", "thickness", "ratio")


def _printed_sets() -> dict[str, Pure]:
    return {
        "al_janaideh": stand_in(),
        "ang": Ang.stack_2hz(),
        "bond_graph": bond_graph_operator(),
        "lumped": lumped_operator(),
    }


@cache
def _refits() -> tuple[Ang, float, float]:
    """Refit once for both tables: it takes most of the time."""
    return refit_ang(), refit_bond_graph(), refit_lumped()


def _corrected_sets() -> dict[str, tuple[Pure | None, str]]:
    ang, t_bond_graph, t_lumped = _refits()
    return {
        "al_janaideh": (None, "nothing to correct; stands in for the measured samples"),
        "ang": (ang, "r_11, r_12 get weight 0; corrected: all 13 weights refitted"),
        "bond_graph": (
            bond_graph_operator(t_bond_graph),
            f"T = {t_bond_graph:.3f} m/C refitted (only scales x)",
        ),
        "lumped": (lumped_operator(t_lumped), f"T = {t_lumped:.3f} N/V refitted"),
    }


def loop_rows() -> tuple[ComparisonRow, ...]:
    """Return bottom, top, thickness and thickness over top of the steady loop of every model.

    2 Hz, 0 to 100 V, third period; the printed column is the measured loop.
    """
    printed, corrected = _printed_sets(), _corrected_sets()
    rows: list[ComparisonRow] = []
    for key, operator in printed.items():
        better, remark = corrected[key]
        loop = steady_loop(better) if better is not None else None
        rows += _loop(LABELS[key], steady_loop(operator), loop, remark)
    note = "elements converted from (6.2) in closed form: the structure can do it, table 6.4 cannot"
    return (
        *rows,
        *_loop("lumped, 10 other elements", None, steady_loop(converted_maxwell()), note),
    )


def _loop(
    label: str, given: SteadyLoop | None, corrected: SteadyLoop | None, remark: str
) -> list[ComparisonRow]:
    return [
        ComparisonRow(
            f"{label}: {'thickness/top' if name == 'ratio' else name}",
            "%" if name == "ratio" else "nm",
            named(MEASURED_LOOP, name),
            None if given is None else float(getattr(given, name)),
            None if corrected is None else float(getattr(corrected, name)),
            remark if name == "bottom" else "",
        )
        for name in QUANTITIES
    ]


def converted_maxwell() -> PrandtlIshlinskii:
    """Return the lumped model whose Maxwell elements are those of (6.2), V to m.

    The way is (6.2) -> V_h(q) -> Maxwell elements and a linear rest -> lumped model -> V to m.
    """
    constants = lumped_constants()
    plays = lumped_law(stand_in(), constants).operator
    assert isinstance(plays, PrandtlIshlinskii)  # the inverse of (6.2) is plays
    elements, rest = maxwell_elements(plays)
    back = pure_from_lumped(Hysteretic(plus_linear(elements, rest)), constants)
    assert isinstance(back, PrandtlIshlinskii)
    return back


def spacing_rows() -> tuple[ComparisonRow, ...]:
    """Return the loop of the eleven weights of (6.3) under other readings of the thresholds."""
    right = steady_loop(Ang.stack_2hz())
    readings = (
        ("r_i = i 50/10 V", ang_with_spacing(5.0)),
        ("r_i = i 50/11 V", ang_with_spacing(50.0 / 11.0)),
        ("r_i = (i + 1) 50/12 V", ang_with_spacing(50.0 / 12.0, first=1)),
    )
    rows: list[ComparisonRow] = []
    for reading, operator in readings:
        note = "ruled out: corrected is i 50/12 V with r_0 = 0, as the printed spacing 4.17 says"
        rows += _loop(f"Ang (6.3), {reading}", steady_loop(operator), right, note)[:3]
    return tuple(rows)


def error_rows() -> tuple[ComparisonRow, ...]:
    """Return tables 6.3 and 6.5: largest and rms error of every model on both inputs.

    Printed: against the measured samples. Computed: against the stand-in.
    """
    printed, corrected = _printed_sets(), _corrected_sets()
    rows: list[ComparisonRow] = []
    for key, operator in printed.items():
        better, remark = corrected[key]
        if better is None:
            remark = "is the stand-in itself: nothing to compare with"
        for shape, u in (("sine", sine()), ("triangle", triangle())):
            given = None if better is None else misfit(operator, stand_in(), u)
            after = None if better is None else misfit(better, stand_in(), u)
            for name, attribute in (("max", "maximum"), ("rms", "rms")):
                rows.append(
                    ComparisonRow(
                        f"{LABELS[key]}: {name}, {shape}",
                        "nm",
                        named(ERRORS, f"{key}: {name} {shape}"),
                        None if given is None else float(getattr(given, attribute)),
                        None if after is None else float(getattr(after, attribute)),
                        remark if (shape, name) == ("sine", "max") else "",
                    )
                )
    return (*rows, *_offset_rows(printed))


def _offset_rows(printed: Mapping[str, Pure]) -> list[ComparisonRow]:
    rows: list[ComparisonRow] = []
    for key in ("ang", "lumped"):
        found = misfit(printed[key], stand_in(), sine(), offset_removed=True)
        note = "an interferometer counts from where it was reset"
        rows.append(
            ComparisonRow(
                f"{LABELS[key]}: max, sine, no offset", "nm", None, found.maximum, None, note
            )
        )
        rows.append(
            ComparisonRow(f"{LABELS[key]}: rms, sine, no offset", "nm", None, found.rms, None)
        )
    return rows
