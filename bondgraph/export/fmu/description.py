"""``modelDescription.xml`` of FMI 2.0 and 3.0, and ``buildDescription.xml``."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from xml.etree import ElementTree as ET

from bondgraph.export.fmu.equations import Equations
from bondgraph.export.fmu.names import structured
from bondgraph.export.fmu.variables import Variable
from bondgraph.signals.units import parse_unit
from bondgraph.support.errors import UnusableInput

TOOL = "Bondsight"


def description_2(
    name: str, identifier: str, token: str, table: Sequence[Variable], found: Equations
) -> bytes:
    """Model description of FMI 2.0, co-simulation; no date, so that equal models give equal bytes.

    Parameters
    ----------
    name, identifier, token : str
        Of the model, of its files, and the GUID.
    table : sequence of Variable
    found : Equations
        For what the outputs depend on.
    """
    root = _root("2.0", name, table, guid=token)
    unit = _add(
        root, "CoSimulation", modelIdentifier=identifier,
        canHandleVariableCommunicationStepSize="true", canInterpolateInputs="true",
        canNotUseMemoryManagementFunctions="true", canGetAndSetFMUstate="true",
        canSerializeFMUstate="true",
    )  # fmt: skip
    _add(_add(unit, "SourceFiles"), "File", name="fmi2.c")
    _units(root, table)
    _log_category(root)
    shown = [v for v in table if v.kind not in ("time", "indicator")]
    place = {v.reference: str(i) for i, v in enumerate(shown, 1)}
    all_variables = _add(root, "ModelVariables")
    for v in shown:
        outer = _add(
            all_variables, "ScalarVariable", name=v.name, valueReference=str(v.reference),
            description=v.description, causality=v.causality, variability=v.variability,
            **_initial(v),
        )  # fmt: skip
        real = _add(outer, "Real", **_unit(v), **_start(v))
        if v.derivative is not None:
            real.set("derivative", place[v.derivative])
    structure = _add(root, "ModelStructure")
    depends = _dependencies(table, found)
    for tag, kinds in (("Outputs", ("output",)), ("Derivatives", ("rate",))):
        rows = [v for v in shown if v.kind in kinds]
        if rows:
            group = _add(structure, tag)
            for v in rows:
                known = " ".join(place[i] for i in sorted(depends[v.reference]))
                _add(group, "Unknown", index=place[v.reference], dependencies=known)
    rows = [v for v in shown if v.kind in ("output", "rate")]
    if rows:
        group = _add(structure, "InitialUnknowns")
        for v in rows:
            _add(group, "Unknown", index=place[v.reference])
    return _text(root)


def description_3(
    name: str,
    identifier: str,
    token: str,
    table: Sequence[Variable],
    found: Equations,
    nominal: Sequence[float],
) -> bytes:
    """Model description of FMI 3.0, model exchange.

    Parameters
    ----------
    name, identifier, token : str
        Of the model, of its files, and the instantiation token.
    table : sequence of Variable
    found : Equations
    nominal : sequence of float
        Typical size of each state.
    """
    root = _root("3.0", name, table, instantiationToken=token)
    _add(
        root, "ModelExchange", modelIdentifier=identifier, needsCompletedIntegratorStep="true",
        canGetAndSetFMUState="true", canSerializeFMUState="true",
    )  # fmt: skip
    _units(root, table)
    _log_category(root)
    shown = [v for v in table if v.kind != "option"]
    sizes = iter(nominal)
    all_variables = _add(root, "ModelVariables")
    for v in shown:
        real = _add(
            all_variables, "Float64", name=v.name, valueReference=str(v.reference),
            description=v.description, causality=v.causality, variability=v.variability,
            **(_initial(v) if v.kind != "time" else {}), **_unit(v), **_start(v),
        )  # fmt: skip
        if v.derivative is not None:
            real.set("derivative", str(v.derivative))
        if v.kind == "state":
            real.set("nominal", repr(float(next(sizes))))
    structure = _add(root, "ModelStructure")
    depends = _dependencies(table, found)
    for tag, kind in (("Output", "output"), ("ContinuousStateDerivative", "rate")):
        for v in (v for v in shown if v.kind == kind):
            known = " ".join(str(i) for i in sorted(depends[v.reference]))
            _add(structure, tag, valueReference=str(v.reference), dependencies=known)
    for v in (v for v in shown if v.kind in ("output", "rate")):
        _add(structure, "InitialUnknown", valueReference=str(v.reference))
    for v in (v for v in shown if v.kind == "indicator"):
        _add(structure, "EventIndicator", valueReference=str(v.reference))
    return _text(root)


def build_description(identifier: str) -> bytes:
    """How to compile the sources, as FMI 3.0 wants it."""
    root = ET.Element("fmiBuildDescription", fmiVersion="3.0")
    one = _add(root, "BuildConfiguration", modelIdentifier=identifier)
    files = _add(one, "SourceFileSet", language="C99")
    _add(files, "SourceFile", name="fmi3.c")
    _add(one, "Library", name="m", external="true")
    return _text(root)


def _root(version: str, name: str, table: Sequence[Variable], **token: str) -> ET.Element:
    names = [v.name for v in table if v.kind != "rate"]  # der(x) is part of both conventions
    fixed = {
        "fmiVersion": version,
        "modelName": _printable(name),
        "generationTool": TOOL,
        "variableNamingConvention": "structured" if structured(names) else "flat",
    }
    return ET.Element("fmiModelDescription", fixed | token)


def _add(parent: ET.Element, tag: str, **attributes: str) -> ET.Element:
    return ET.SubElement(parent, tag, attributes)


def _log_category(root: ET.Element) -> None:
    group = _add(root, "LogCategories")
    _add(group, "Category", name="logStatusError")


def _initial(v: Variable) -> dict[str, str]:
    if v.causality == "input":
        return {}
    return {"initial": "exact" if v.start is not None else "calculated"}


def _start(v: Variable) -> dict[str, str]:
    return {} if v.start is None else {"start": repr(float(v.start))}


def _unit(v: Variable) -> dict[str, str]:
    return {"unit": v.unit} if v.unit not in ("", "1") else {}


def _units(root: ET.Element, table: Iterable[Variable]) -> None:
    names = sorted({v.unit for v in table if _unit(v)})
    if not names:
        return
    group = _add(root, "UnitDefinitions")
    for name in names:
        one = _add(group, "Unit", name=name)
        try:
            unit = parse_unit(name)
        except UnusableInput:
            continue  # a unit nobody knows is named, not explained
        powers = zip(("m", "kg", "s", "A", "K"), unit.dims, strict=True)
        base = {symbol: str(power) for symbol, power in powers if power}
        if unit.scale != 1.0:
            base["factor"] = repr(unit.scale)
        _add(one, "BaseUnit", **base)


def _dependencies(table: Sequence[Variable], found: Equations) -> dict[int, list[int]]:
    """Value references of the inputs and states that outputs and rates depend on."""
    by_kind: dict[str, list[int]] = {}
    for v in table:
        by_kind.setdefault(v.kind, []).append(v.reference)
    known = [*by_kind.get("input", []), *by_kind.get("state", [])]
    out = {}
    for kind, pattern in (("output", found.feedthrough), ("rate", found.rates_by)):
        for reference, row in zip(by_kind.get(kind, []), pattern, strict=True):
            out[reference] = [r for r, there in zip(known, row, strict=True) if there]
    return out


def _printable(text: str) -> str:
    """Without the control characters that XML forbids; the rest is escaped by the writer."""
    return "".join(ch for ch in text if ch.isprintable()) or "model"


def _text(root: ET.Element) -> bytes:
    ET.indent(root)
    return bytes(ET.tostring(root, encoding="UTF-8", xml_declaration=True)) + b"\n"
