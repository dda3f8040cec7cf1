"""Units of a declaration are SI: what was not converted, or cannot be read, is refused."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from bondgraph.graph.elements import Element, Source
from bondgraph.graph.parameter import Parameter
from bondgraph.graph.sensors import Sensor
from bondgraph.signals.units import parse_unit
from bondgraph.support.errors import UnusableInput


def unit_problems(
    elements: Iterable[Element], parameters: Mapping[str, Parameter]
) -> tuple[str, ...]:
    """Return one line for each unit that is no unit, or that nothing was converted from.

    Examples
    --------
    >>> from bondgraph import Se
    >>> print(unit_problems([Se("F", unit="kN")], {})[0])
    F (Se): unit kN is not SI, and commands and readings of a model are in N; give unit='N' \
(columns of files keep theirs and are converted)
    """
    lines = []
    for e in elements:
        for text in (getattr(e, "unit", ""), *getattr(e, "units", ())):
            if why := _refused(text):
                lines.append(f"{e.name} ({e.kind}): {why[0]}{_remedy(e, why[1])}")
    said = {e.name for e in elements}
    for p in parameters.values():
        if p.name not in said and (why := _refused(p.unit)):
            remedy = f"; give its numbers in {why[1]}" if why[1] else ""
            lines.append(f"parameter {p.name}: {why[0]}{remedy}")
    return tuple(dict.fromkeys(lines))


def _refused(text: str) -> tuple[str, str] | None:
    """Return what is wrong with a unit, and the SI unit if there is one."""
    try:
        unit = parse_unit(text) if text.strip() else None
    except UnusableInput as error:
        return str(error), ""
    return None if unit is None or unit.is_si else (f"unit {text} is not SI", unit.si)


def _remedy(e: Element, si: str) -> str:
    if not si:
        return ""
    if isinstance(e, Source | Sensor):
        return (
            f", and commands and readings of a model are in {si}; give unit='{si}' (columns of "
            "files keep theirs and are converted)"
        )
    return f", and its law or its parameters are; give them with unit='{si}'"
