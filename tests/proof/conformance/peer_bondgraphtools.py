"""Runs under another Python, where BondGraphTools is installed: description in, relations out.

Stands alone on purpose: it reads one JSON object from its input and writes one to its output, and
imports nothing of this project.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

LIBRARY = "conformance"


def derive(description: dict[str, Any]) -> dict[str, Any]:
    """Build the model, return its relations and what their symbols stand for."""
    bgt = importlib.import_module("BondGraphTools")
    importlib.import_module("BondGraphTools.port_hamiltonian")
    symbol = importlib.import_module("sympy").Symbol
    if description["library"]:
        _load(description["library"])
    begin = time.perf_counter()
    model = bgt.new(name="case")
    made: dict[str, Any] = {}
    for c in description["components"]:
        value = _value(c["value"], symbol)
        if c["component"] == "PH":
            value = {"hamiltonian": c["hamiltonian"], "params": value}
        made[c["name"]] = bgt.new(c["component"], name=c["name"], library=c["library"], value=value)
    bgt.add(model, *made.values())
    for tail, tail_port, head, head_port in description["bonds"]:
        a, b = made[tail], made[head]
        bgt.connect(
            a if tail_port is None else (a, tail_port), b if head_port is None else (b, head_port)
        )
    relations = [_text(r) for r in model.constitutive_relations]
    return {
        "relations": relations,
        "seconds": time.perf_counter() - begin,
        "states": {k: [c.name, str(v)] for k, (c, v) in model.state_vars.items()},
        "controls": {k: c.name for k, (c, _) in model.control_vars.items()},
    }


def _text(relation: Any) -> str:
    """Text of a relation with e written as exp(1), because ``E`` is also a name."""
    printing = importlib.import_module("sympy.printing.str")

    class Printer(printing.StrPrinter):  # type: ignore[name-defined,misc]
        def _print_Exp1(self, _: Any) -> str:
            return "exp(1)"

    return str(Printer().doprint(relation))


def _value(value: Any, symbol: Any) -> Any:
    """Numbers as they are, ``{"symbol": name}`` as a symbol; names of parameters to values."""
    if isinstance(value, dict) and set(value) == {"symbol"}:
        return symbol(value["symbol"])
    if isinstance(value, dict):
        return {k: _value(v, symbol) for k, v in value.items()}
    return value


def _load(components: dict[str, Any]) -> None:
    manager = importlib.import_module("BondGraphTools.component_manager")
    text = json.dumps({"id": LIBRARY, "description": "laws of a case", "components": components})
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "library.json"
        path.write_text(text, encoding="utf-8")
        if not manager.load_library(str(path)):
            raise RuntimeError("the component library was not accepted")


def main() -> None:
    """One description from the input, one result (or error) to the output."""
    description = json.load(sys.stdin)
    with contextlib.redirect_stdout(sys.stderr):
        try:
            result = derive(description)
        except Exception as error:
            result = {"error": f"{type(error).__name__}: {error}"}
    json.dump(result, sys.stdout)


if __name__ == "__main__":
    main()
