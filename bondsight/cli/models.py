"""``bondsight models``: the models that are known by name, as a list or one of them."""

from __future__ import annotations

import argparse
import inspect
from collections.abc import Callable
from itertools import takewhile
from typing import Any


def add_models_command(verbs: Any) -> None:
    """Add the command to the sub-parsers of ``bondsight``."""
    p = verbs.add_parser("models", help="list the models known by name, or describe one")
    p.add_argument("names", nargs="*", metavar="MODEL", help="describe these")
    p.set_defaults(run=_models)


def _models(options: argparse.Namespace) -> int:
    from actuators.models.catalogue import MODELS
    from bondgraph.support.errors import UnusableInput, unknown_name

    for n in options.names:
        if n not in MODELS:
            raise UnusableInput(str(unknown_name("model", n, "the catalogue", MODELS)))
    if options.names:
        print("\n\n".join(_described(n, MODELS[n]) for n in options.names))
        return 0
    width = max(map(len, MODELS))
    print("\n".join(f"{n:<{width}}  {_first_line(f)}" for n, f in MODELS.items()))
    return 0


def _first_line(factory: Callable[..., Any]) -> str:
    line = _text(factory).partition("\n")[0].removeprefix("Return the ").removeprefix("Return ")
    return line.rstrip(".")


def _text(factory: Callable[..., Any]) -> str:
    while hasattr(factory, "func"):  # a partial says nothing of itself
        factory = factory.func
    return (inspect.getdoc(factory) or "").replace("``", "")


def _described(name: str, factory: Callable[..., Any]) -> str:
    from bondgraph.graph.sensors import Sensor
    from identification.study.factors import drives

    g = factory()
    inputs = [f"{e.name} [{e.unit or '1'}]" for e in drives(g)]
    readings = [f"{e.name} [{e.unit or '1'}]" for e in g.of_type(Sensor)]
    elements = [f"{e.name} ({e.kind})" for e in g.elements.values()]
    numbers = [f"  {p.name:<12} {p.value:<12.6g} {p.unit}" for p in g.parameters.values()]
    about = _text(factory).partition("\n\n")[2].split("\n\n")
    more = list(takewhile(lambda part: "\n---" not in part, filter(None, about)))
    return "\n".join([
        f"{name}: {_first_line(factory)}", *more, f"inputs: {', '.join(inputs)}",
        f"readings: {', '.join(readings)}", f"elements: {', '.join(elements)}",
        "parameters:", *numbers,
    ])  # fmt: skip
