"""The catalogue in words: as a table, or one effect in full with its law's own words."""

from __future__ import annotations

import inspect
from collections.abc import Iterator, Mapping
from types import MappingProxyType

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import C
from bondgraph.laws.law import Law, law_words
from bondgraph.support.errors import nearest, unknown_name
from identification.diagnosis.catalogue import CATALOGUE, UNNAMED
from identification.diagnosis.catalogue.effect import Effect
from identification.diagnosis.catalogue.lacking_element import LackingElement
from identification.diagnosis.catalogue.places import lump_at
from identification.diagnosis.localisation.recording.variables import variables_of
from identification.report.tables import markdown
from identification.report.words import spaced


def catalogue_table() -> str:
    """Return the catalogue as a Markdown table, one row an effect, in its own order."""
    rows = [(f"`{e.name}`", e.family, f"`{e.law}`", e.sentence) for e in CATALOGUE]
    return markdown(("effect", "family", "law", "in words"), rows)


def described(name: str) -> str:
    """Return everything the catalogue says of one effect, one line each.

    The name of a law, a richer one too, stands for every effect that has it; blanks are as good as
    underscores.

    Raises
    ------
    UnknownName
        If there is none of that name; the nearest names are given.
    """
    plain = "_".join(name.split())
    if plain == UNNAMED.name:
        return _in_full(UNNAMED)
    known = {e.name: [e] for e in CATALOGUE}
    laws: dict[str, list[Effect]] = {}
    for e in CATALOGUE:
        for law in dict.fromkeys((e.law, *e.richer, *(law.name for law in e.laws))):
            laws.setdefault(law, []).append(e)
    found = (laws | known).get(plain)
    if found is None:
        among = known if nearest(plain, known) else laws | known
        raise unknown_name("effect", plain, "the catalogue", among)
    return "\n\n".join(map(_in_full, found))


def _in_full(e: Effect) -> str:
    lines = [f"{e.name} ({e.family}): {e.sentence}"]
    said = (
        ("law", f"{e.law}: {formula(e).replace('`', '')}"), *parameters(e),
        ("looks like", e.looks), ("contains", ", ".join(e.simpler)),
        ("richer laws", ", ".join(e.richer)),
        ("confused with", ", ".join(e.confused_with)), ("separated by", e.separated_by),
        ("source", e.source),
    )  # fmt: skip
    return "\n".join([*lines, *(f"  {word}: {text}" for word, text in said if text)])


def formula(e: Effect) -> str:
    """Return the law of an effect in its own words, where its formula stands.

    An effect that is no law at an element is described as a whole.
    """
    if e.laws:
        return " ".join(map(law_words, e.laws))
    return " ".join(inspect.cleandoc(type(e).__doc__ or "").split("\n\n")[0].split())


def parameters(e: Effect) -> Iterator[tuple[str, str]]:
    """Yield the name of each parameter of an effect's law, without its element, and what it is."""
    said = dict(e.meanings)
    units: dict[str, str] = {}
    for law in e.laws:
        said = {**law.meanings, **said}
        units |= usual_units(law)
    for name, meaning in said.items():
        unit = "" if name.endswith(OWN) else units.get(name, "")
        yield f"  {name}", f"{meaning} (in {unit}, say)" if unit not in ("", "1") else meaning


OWN = "_own"
"""How a parameter ends that is the element's slope: its unit is that of the place."""


def usual_units(law: type[Law]) -> dict[str, str]:
    """Return units of parameters where nothing is said of the element; none where that is needed.

    Examples
    --------
    >>> from bondgraph.laws import Stribeck
    >>> usual_units(Stribeck)
    {'F_c': 'N', 'F_d': 'N', 'f_s': 'm/s'}
    """
    try:
        made = law()
    except TypeError:  # some need to know their place
        return {}
    return {p.name.removesuffix("_"): p.unit for p in made.parameters("")}


BENT: Mapping[str, str] = MappingProxyType(
    {"V": "nonlinear capacitance", "Pa": "nonlinear fluid capacity", "K": "nonlinear heat capacity"}
)
"""What a store whose effort bends is called, by the unit of its effort."""


def called(name: str, graph: BondGraph, element: str) -> str:
    """Return the name of an effect in words, after what it is in the domain of its place.

    Examples
    --------
    >>> from bondgraph import BondGraph, C, I, One, R
    >>> with BondGraph("circuit") as g:
    ...     loop = One("loop") >> R("R", 1.0, unit="ohm")
    ...     loop = One("other") >> C("K", 1.0, unit="F")
    >>> called("linear_inertia", g, "R"), called("nonlinear_stiffness", g, "K")
    ('inductance (linear inertia)', 'nonlinear capacitance (nonlinear stiffness)')
    >>> called("creep", g, "K")
    'creep'
    """
    held, plain = graph.elements.get(element), spaced(name)
    if held is None:
        return plain
    own = ""
    lacking = (e for e in CATALOGUE if e.name == name and isinstance(e, LackingElement))
    if (effect := next(lacking, None)) is not None:
        own = effect.thing(graph, held)
    elif name == "linear_capacity":
        own = lump_at(graph, held)
    elif name == "nonlinear_stiffness" and isinstance(held, C):
        own = BENT.get(variables_of(held).effort_unit, "")
    return f"{own} ({plain})" if own and own not in plain else plain


MOST = 3
"""Labels of a list that are told in words; a verdict's data hold all."""


def briefly(reason: str) -> str:
    """Return a reason in words, a long list of labels in it cut.

    Examples
    --------
    >>> print(briefly("as good: creep at a, creep at b, creep at c, creep at d, low_pass at u"))
    as good: creep at a, creep at b, creep at c and 2 more (all in verdict.json)
    """
    head, sign, rest = reason.rpartition(": ")
    labels = rest.split(", ")
    if len(labels) > MOST + 1 and all(" at " in one for one in labels):
        more = f"{len(labels) - MOST} more (all in verdict.json)"
        reason = f"{head}{sign}{', '.join(labels[:MOST])} and {more}"
    return spoken(reason)


def spoken(text: str) -> str:
    """Replace the names of effects by words."""
    for e in CATALOGUE:
        text = text.replace(e.name, spaced(e.name))
    return text
