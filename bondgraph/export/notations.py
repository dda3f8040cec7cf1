"""A model's equations as text, in any notation; what a notation needs is imported when asked."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

from bondgraph.support.errors import require_known

if TYPE_CHECKING:
    from bondgraph.equations.system import System
    from bondgraph.graph.bond_graph import BondGraph
    from bondgraph.laws import Law


def notation(model: BondGraph, format: str = "ordered", *, laws: Iterable[type[Law]] = ()) -> str:
    """Return the equations of `model` as text.

    Parameters
    ----------
    model : BondGraph
    format : str
        One of `NOTATIONS`: ``text`` names, units and values with the executable assignments;
        ``ordered`` causal assignments with whole laws; ``closed`` forms; ``causality`` strokes with
        reasons; ``latex`` closed forms; ``numpy``, ``c``, ``modelica``, ``json`` as exported.
    laws : iterable of type of Law, optional
        Laws that ``json`` may hold beside those of `bondgraph.laws`.

    Raises
    ------
    UnknownName
        No such notation.
    BondsightError
        The notation cannot hold this model; the line says why.
    """
    require_known("notation", "bondsight equations", NOTATIONS, format)
    if format == "json":
        return json_text(model, laws).rstrip("\n")
    return NOTATIONS[format](model).rstrip("\n")


def program_of(graph: BondGraph) -> Any:
    """Return the `Program` of a graph."""
    from bondgraph.equations.codegen import program

    return program(graph)


def of_program(place: str) -> Callable[[BondGraph], Any]:
    """Return a function of a graph: what ``module.name`` of this package makes of its program."""
    module, _, name = place.partition(".")
    return lambda graph: getattr(import_module(f"bondgraph.export.{module}"), name)(
        program_of(graph)
    )


def _text(graph: BondGraph) -> str:
    from bondgraph.equations.decimals import as_text

    p = program_of(graph)
    values = dict(zip(p.parameters, p.nominal, strict=True))
    lines = [p.name]
    for what, names in (
        ("states", p.states), ("unknowns", p.algebraic), ("inputs", p.inputs),
        ("outputs", p.outputs),
    ):  # fmt: skip
        if names:
            lines.append(f"{what}: {', '.join(_with_unit(n, p.units) for n in names)}")
    units = {n: "" if unit == "1" else unit for n, unit in p.units.items()}
    lines += [f"{n} = {v:.9g} {units.get(n, '')}".rstrip() for n, v in values.items()]
    lines.append("")
    for step in p.steps:
        shown = "" if step.expression is None else as_text(step.expression)
        if step.law is not None:
            law = p.laws[step.law]
            rest = f"; {law.law.n_memory} numbers of memory" if law.law.n_memory else ""
            shown = f"{law.law.name}({as_text(law.argument)}{rest})"
        lines.append(
            f"{step.target} := {shown}" + (f"    ({step.comment})" if step.comment else "")
        )
    lines += [f"d{n}/dt := {as_text(e)}" for n, e in zip(p.states, p.rates, strict=True)]
    lines += [
        f"0 = {as_text(e)}    (for {n})" for n, e in zip(p.algebraic, p.residuals, strict=True)
    ]
    lines += [f"{n} := {as_text(e)}" for n, e in zip(p.outputs, p.readings, strict=True)]
    return "\n".join(lines)


def _with_unit(name: str, units: Any) -> str:
    unit = units.get(name, "")
    return f"{name} [{unit}]" if unit else name


def _system(graph: BondGraph) -> System:
    from bondgraph.equations.derivation import equations

    return equations(graph)


def _ordered(graph: BondGraph) -> str:
    return str(_system(graph))


def _closed(graph: BondGraph) -> str:
    from bondgraph.equations.decimals import as_text

    model = _system(graph)
    lines = [f"d{s.name}/dt = {as_text(model.shown(s.rate))}" for s in model.stored]
    lines += [f"0 = {as_text(model.shown(a.residual))}" for a in model.algebraic]
    lines += [f"{n} = {as_text(model.shown(y))}" for n, y, _ in model.readings]
    return "\n".join([*lines, *model.formulas])


def _causality(graph: BondGraph) -> str:
    from bondgraph.causality.assignment import assign_causality

    return str(assign_causality(graph))


def _latex(graph: BondGraph) -> str:
    from bondgraph.export.latex import latex

    return latex(_system(graph))


def _c(graph: BondGraph) -> str:
    """Return all files one after the other, each under a comment with its name."""
    texts = of_program("c_code.c_code")(graph)
    return "\n".join(f"/* ---- {name} ---- */\n{text}" for name, text in texts.items())


def json_text(graph: BondGraph, laws: Iterable[type[Law]] = ()) -> str:
    """Return a graph as JSON, which may hold these further laws."""
    from bondgraph.export.graph_json.write_graph import to_json

    return to_json(graph, laws=laws)


NOTATIONS: Final[dict[str, Callable[[BondGraph], str]]] = {
    "text": _text,
    "ordered": _ordered,
    "closed": _closed,
    "causality": _causality,
    "latex": _latex,
    "numpy": of_program("numpy_module.numpy_module"),
    "c": _c,
    "modelica": of_program("modelica.modelica"),
    "json": json_text,
}
"""The notations by name."""
