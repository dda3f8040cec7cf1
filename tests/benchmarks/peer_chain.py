"""Runs under another Python, where BondGraphTools is installed: the chain in its own words.

Stands alone on purpose: it reads one JSON object (the values of a chain) from its input, writes one
to its output, and imports nothing of this project.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import sys
import time
from typing import Any


def derive(values: dict[str, Any]) -> dict[str, Any]:
    """Build the chain with numbers and return its state equations, their names and the seconds."""
    bgt = importlib.import_module("BondGraphTools")
    begin = time.perf_counter()
    model = bgt.new(name="chain")

    def made(kind: str, name: str, value: Any = None) -> Any:
        component = bgt.new(kind, name=name, value=value)
        bgt.add(model, component)
        return component

    at = made("1", "v_1")
    bgt.connect(made("Se", "F"), at)
    masses = values["masses"]
    for i, mass in enumerate(masses, start=1):
        between, link = made("0", f"n_{i}"), made("1", f"d_{i}")
        bgt.connect(at, made("I", f"m_{i}", mass))
        bgt.connect(at, between)
        bgt.connect(between, link)
        bgt.connect(link, made("C", f"k_{i}", values["compliance"]))
        bgt.connect(link, made("R", f"b_{i}", values["damping"]))
        if i < len(masses):
            at = made("1", f"v_{i + 1}")
            bgt.connect(between, at)
    relations = [str(r) for r in model.constitutive_relations]
    return {
        "seconds": time.perf_counter() - begin,
        "relations": relations,
        "states": {k: c.name for k, (c, _) in model.state_vars.items()},
        "controls": {k: c.name for k, (c, _) in model.control_vars.items()},
    }


def main() -> None:
    """One chain from the input, one result to the output."""
    with contextlib.redirect_stdout(sys.stderr):
        result = derive(json.load(sys.stdin))
    json.dump(result, sys.stdout)


if __name__ == "__main__":
    main()
