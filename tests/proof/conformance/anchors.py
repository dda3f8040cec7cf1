"""The same cases run by BondGraphTools 0.4.6, in a Python of its own.

Its conventions: port flows point into the component; its gyrator is ``e_0 = R f_1, e_1 = -R f_0``
and its transformer ``e_1 = r e_0, f_0 = -r f_1``, so that port 1 is where our half arrow enters.
"""

from __future__ import annotations

import json
import subprocess
import time
from pathlib import Path
from typing import Any

import sympy as sp

from bondgraph.support.errors import BondsightError, UnusableInput
from tests.proof.conformance.answer import Answer
from tests.proof.conformance.case import Case, Part
from tests.proof.conformance.check import REFUSED, UNSAID, Judgement, judge
from tests.proof.conformance.implicit import from_relations
from tests.proof.conformance.reader import read_expression

TIME_LIMIT = 30.0
_SCRIPT = Path(__file__).with_name("peer_bondgraphtools.py")
_OWN = "conformance"
_VERSION = "import importlib.metadata as m; print(m.version('BondGraphTools'))"


class NotExpressible(BondsightError):
    """The tool has no means to state the case."""


def peer_version(python: str) -> str:
    """Return the version of BondGraphTools in that Python.

    Raises
    ------
    UnusableInput
        There is no such Python, or it has no BondGraphTools.
    """
    try:
        run = subprocess.run(
            [python, "-I", "-c", _VERSION], capture_output=True, text=True, timeout=TIME_LIMIT
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise UnusableInput(f"--peer {python} cannot be run: {error}; name a Python") from None
    if run.returncode:
        raise UnusableInput(
            f"--peer {python} has no BondGraphTools; install BondGraphTools==0.4.6 there"
        )
    return run.stdout.strip()


def judge_bondgraphtools(
    case: Case, python: str, *, numbers: bool = False, limit: float = TIME_LIMIT
) -> Judgement:
    """Let BondGraphTools derive the equations of a case and judge them like our own.

    Parameters
    ----------
    case : Case
    python : str
        A Python with BondGraphTools.
    numbers : bool
        Give numbers for the parameters instead of symbols.
    limit : float
        Seconds for the case, its start included.
    """
    begin = time.perf_counter()
    try:
        description = describe(case, numbers=numbers)
        run = subprocess.run(
            [python, "-I", str(_SCRIPT)],
            input=json.dumps(description), capture_output=True, text=True, timeout=limit,
        )  # fmt: skip
    except NotExpressible as error:
        return Judgement(case.identity, UNSAID, str(error))
    except subprocess.TimeoutExpired:
        return Judgement(case.identity, REFUSED, f"no result within {limit:g} s", (), limit)
    spent = time.perf_counter() - begin
    try:
        reply = json.loads(run.stdout)
        if "error" in reply:
            return Judgement(case.identity, REFUSED, _short(reply["error"]), (), spent)
        answer = _answer(case, reply, description["numbers"])
        spent = float(reply.get("seconds", spent))  # without the start of its Python
    except (json.JSONDecodeError, BondsightError) as error:
        return Judgement(case.identity, REFUSED, _short(str(error)), (), spent)
    return judge(case, answer, spent)


def _answer(case: Case, reply: dict[str, Any], numbers: dict[str, float]) -> Answer:
    """Relations in the peer's symbols -> an answer in the names of the case."""
    table: dict[str, sp.Expr] = {}
    for x, (element, variable) in reply["states"].items():
        part = case.part(element)
        port = int(variable.rpartition("_")[2])
        state = f"{'p' if part.type == 'I' else 'q'}_{element}"
        state += str(port + 1) if part.type == "CF" else ""
        table[x], table[f"d{x}"] = sp.Symbol(state), sp.Symbol(f"d{state}")
    for u, element in reply["controls"].items():
        sign = _source_sign(case, case.part(element))
        for d in ("", "d"):
            table[d + u] = sign * sp.Symbol(f"{d}u_{element}")
    for name in case.parameters:
        table[_own_name(name)] = sp.Symbol(name)
    relations = []
    for text in reply["relations"]:
        e = read_expression(text)
        relations.append(e.xreplace({s: table.get(str(s), s) for s in e.free_symbols}))
    return from_relations(case, relations, numbers)


# -- describing a case ------------------------------------------------------------------------
def describe(case: Case, *, numbers: bool = False) -> dict[str, Any]:
    """Return a case as components, library and bonds of BondGraphTools.

    Raises
    ------
    NotExpressible
        It has a modulated source.
    """
    given = {n: case.values.get(n, float(i + 2)) for i, n in enumerate(case.parameters)}
    table = given if numbers else {}
    library: dict[str, Any] = {}
    components = [_component(case, p, table, library) for p in case.parts]
    bonds = [
        [tail, _port(case, tail, b), head, _port(case, head, b)]
        for b, (tail, head) in enumerate(case.bonds)
    ]
    return {"components": components, "library": library, "bonds": bonds, "numbers": table}


def _component(
    case: Case, p: Part, numbers: dict[str, float], library: dict[str, Any]
) -> dict[str, Any]:
    made: dict[str, Any] = {"name": p.name, "component": p.type, "library": "base", "value": None}
    if p.type == "MSe":
        raise NotExpressible(f"{p.name} is a modulated source")
    if p.energy is not None:
        ports = range(1, case.ports(p.name) + 1)
        energy, made["value"] = _local(p.energy, numbers, {f"q{i}": f"x{i}" for i in ports})
        made |= {"component": "PH", "hamiltonian": energy}
    elif p.law is not None:
        made |= {"component": f"law_{p.name}", "library": _OWN}
        library[made["component"]], made["value"] = _law_component(p, numbers)
    elif p.type == "RE":
        made |= {"component": "Re", "library": "BioChem"}
        made["value"] = {"r": _given(p.value, numbers), "R": 1, "T": 1}
    elif p.value is not None:
        made["value"] = _given(p.value, numbers)
    return made


def _law_component(p: Part, numbers: dict[str, float]) -> tuple[dict[str, Any], dict[str, Any]]:
    law, values = _local(p.law, numbers, {"q": "q_0", "f": "f_0"})
    made: dict[str, Any] = {
        "description": "a law",
        "class": "Component",
        "metamodel": p.type,
        "ports": {"0": None},
        "params": {n: {"description": n} for n in values},
        "constitutive_relations": [f"e_0 - ({law})"],
    }
    if p.type == "C":
        made["state_vars"] = {"q_0": "displacement"}
        made["constitutive_relations"].append("dq_0 - f_0")
    return made, values


def _local(
    e: sp.Expr, numbers: dict[str, float], ports: dict[str, str]
) -> tuple[str, dict[str, Any]]:
    """Text of a law in its own parameters ``a0, a1, ..`` and their values."""
    names = sorted(str(s) for s in e.free_symbols if str(s) not in ports)
    own = {n: f"a{i}" for i, n in enumerate(names)}
    text = str(e.xreplace({sp.Symbol(n): sp.Symbol(m) for n, m in {**own, **ports}.items()}))
    return text, {own[n]: _given(sp.Symbol(n), numbers) for n in names}


def _given(e: sp.Expr, numbers: dict[str, float]) -> Any:
    """Return a number, or a symbol that no name of the peer can collide with."""
    if e.is_Symbol and str(e) not in numbers:
        return {"symbol": _own_name(str(e))}
    value = float(e.xreplace({sp.Symbol(n): sp.Float(v) for n, v in numbers.items()}))
    return int(value) if value.is_integer() else value


def _own_name(parameter: str) -> str:
    return f"par_{parameter}"


def _port(case: Case, name: str, b: int) -> int | None:
    part = case.part(name)
    enters = case.bonds[b][1] == name
    if part.type in ("TF", "GY"):
        return 1 if enters else 0
    if part.type == "RE":
        return 0 if enters else 1
    if part.type == "CF":
        return case.bonds_of(name).index(b)
    return None


def _source_sign(case: Case, p: Part) -> int:
    """Return -1 for a flow source drawn inwards: the peer's always point out of themselves."""
    (b,) = case.bonds_of(p.name)
    return -1 if p.type == "Sf" and case.bonds[b][1] == p.name else 1


def _short(text: str) -> str:
    line = " ".join(text.split())
    return line if len(line) <= 160 else line[:157] + "..."
