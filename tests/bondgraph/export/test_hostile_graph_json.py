"""Documents of strangers: refused in one line, nothing executed, cheap at any size."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from actuators.models.opening import load_model
from bondgraph import BondGraph
from bondgraph.export.graph_json import read_graph as graph_json
from bondgraph.export.graph_json.read_graph import from_json
from bondgraph.export.graph_json.write_graph import to_json
from bondgraph.graph import elements as el
from bondgraph.graph.elements import Element
from bondgraph.support.errors import UnusableInput
from tests.bondgraph.export.json_examples import VALIDATOR, assert_same, every_element
from tests.bondgraph.hysteresis.examples import EXAMPLES
from tests.counted import calls


def document(**changes: Any) -> str:
    data = {
        "schema": graph_json.SCHEMA,
        "name": "rc",
        "parameters": [{"name": "a", "value": 2.0}],
        "elements": [
            {"kind": "Se", "name": "V"},
            {"kind": "1", "name": "loop"},
            {"kind": "R", "name": "R_1", "value": ["*", 2, "a"], "law": {"law": "coulomb"}},
        ],
        "bonds": [["V", "loop"], ["loop", "R_1"]],
    }
    return json.dumps(data | changes)


def element(**fields_: Any) -> str:
    return document(elements=[{"kind": "R", "name": "R_1"} | fields_], bonds=[])


def operator(**parameters: Any) -> str:
    return element(law={"law": "operator", "operator": parameters})


def test_the_document_itself_is_sound() -> None:
    VALIDATOR.validate(json.loads(document()))
    assert len(from_json(document()).elements) == 3


HOSTILE = {
    "no json": ("{nonsense", "no JSON"),
    "cut off": (document()[:-20], "no JSON"),
    "a list": ("[1, 2]", "a list is not an object"),
    "nan": (document(parameters=[{"name": "a", "value": float("nan")}]), "NaN is not"),
    "infinity": (document(parameters=[{"name": "a", "value": -float("inf")}]), "-Infinity is not"),
    "too large": (element(value=1).replace('"value": 1', '"value": 1e999'), "too large"),
    "huge integer": (element(value=2**53 + 1), r"beyond 2\*\*53"),
    "endless digits": (
        element(value=1).replace('"value": 1', '"value": 1' + "0" * 10**6),
        "beyond",
    ),
    "key twice": ('{"schema": "bondsight-graph/1", "schema": 1}', "'schema' is given twice"),
    "no schema": ('{"name": "a", "elements": []}', "schema null cannot be read"),
    "version": (document(schema="bondsight-graph/99"), "'bondsight-graph/99' cannot be read"),
    "unknown key": (document(memory=[]), "no key of a graph 'memory'"),
    "near key": (document(bond=[]), "did you mean 'bonds'"),
    "no elements": ('{"schema": "bondsight-graph/1", "name": "a"}', "needs its 'elements'"),
    "elements no list": (document(elements={}), "an object is not a list"),
    "element no object": (document(elements=[3]), "3 is not an object"),
    "kind": (element(kind="Resistor"), "no element kind 'Resistor'"),
    "kind no text": (element(kind=[]), "no element kind a list"),
    "name": (element(name="a b"), "'a b' is not a name"),
    "private name": (element(name="__class__"), "'__class__' is not a name"),
    "name no text": (element(name=7), "7 is not text"),
    "long name": (element(name="a" * 10**6), "1000000 signs"),
    "surrogate": (document(name="\ud800"), "not printable"),
    "terminal": (document(name="\x1b[2J"), "not printable"),
    "name twice": (document(elements=[{"kind": "R", "name": "a"}] * 2), "two elements are called"),
    "parameter twice": (document(parameters=[{"name": "a", "value": 1}] * 2), "declared twice"),
    "no value": (document(parameters=[{"name": "a"}]), "needs its field 'value'"),
    "value a flag": (document(parameters=[{"name": "a", "value": True}]), "true is not a number"),
    "unknown field": (element(resistance=3), "no field of R 'resistance'"),
    "near field": (element(valu=3), "did you mean 'value'"),
    "field of others": (element(heat="energy"), "no field of R 'heat'"),
    "heat": (element(kind="RS", heat="cold"), "not one of energy, entropy"),
    "flag": (element(fixed=1), "1 is not true or false"),
    "spread": (element(spread=-1), "above 0"),
    "ports": (element(kind="CF", ports=10**9), "from 1 to 1000"),
    "bond to nobody": (document(bonds=[["V", "lop"]]), "did you mean 'loop'"),
    "bond of three": (document(bonds=[["V", "loop", "R_1"]]), "not a pair"),
    "bond to itself": (document(bonds=[["V", "V"]]), "bonded to itself"),
    "bonded twice": (document(bonds=[["V", "loop"], ["loop", "V"]]), "bonded twice"),
    "law": (element(law={"law": "colomb"}), "did you mean 'coulomb'"),
    "law no name": (element(law={}), "no law null"),
    "law no object": (element(law="coulomb"), "not an object"),
    "field of a law": (element(law={"law": "coulomb", "forse": 1}), "did you mean 'force'"),
    "force": (element(law={"law": "coulomb", "force": -1}), "of at least 0"),
    "knots": (element(law={"law": "unnamed_curve", "knots": [0, 0]}), "not in rising order"),
    "half": (element(law={"law": "polynomial", "half": 0}), "other than 0"),
    "orders": (element(law={"law": "polynomial", "orders": [10**9]}), "from 0 to 64"),
    "table": (element(law={"law": "table", "knots": [0, 1], "values": [1, 2, 3]}), "2 knots and 3"),
    "operator": (operator(kind="os.system"), "no operator kind 'os.system'"),
    "no operator": (element(law={"law": "operator"}), "needs its field 'operator'"),
    "operator lacks": (operator(kind="dahl"), "dahl needs its field 'stiffness'"),
    "operator surplus": (operator(kind="dahl", x=1), "no field of dahl 'x'"),
    "operator text": (operator(kind="dead_zone", thresholds="0", weights=[1]), "not a list"),
    "operator entry": (operator(kind="dead_zone", thresholds=["0"], weights=[1]), "not a number"),
    "operator in another": (operator(kind="ang", play=3, dead_zone=3), "3 is not an object"),
    "another operator": (
        operator(
            kind="inverse",
            forward={"kind": "dahl", "stiffness": 1, "coulomb": 1},
        ),
        "dahl is no operator that is solved step by step",
    ),
    "operator domain": (operator(kind="dead_zone", thresholds=[1, 1], weights=[1, 1]), "not above"),
    "many hysterons": (
        operator(kind="al_janaideh", q=1, c=1, sigma=1, alpha=1, beta=1, count=10**9),
        "0 to 10000",
    ),
    "unknown operation": (element(value=["system", "ls"]), "no operation 'system'"),
    "empty operation": (element(value=[]), "not an operation"),
    "operands": (element(value=["/", 1]), "takes 2 operands, not 1"),
    "text to parse": (element(value="__import__('os')"), "not a name"),
    "1/0": (element(value=["/", 1, 0]), "no real value"),
    "log(-1)": (element(value=["log", -1]), "no real value"),
    "power tower": (element(value=["^", 10, ["^", 10, 10]]), "not within 100"),
    "exponential tower": (element(value=["exp", ["exp", ["exp", 1000]]]), "beyond a double"),
    "parameter tower": (element(value=["exp", ["exp", ["exp", ["*", 9, "a"]]]]), "beyond a double"),
    "condition": (element(value=["<", 1, "a"]), "put it into 'where'"),
    "no condition": (element(value=["where", 1, 2, 3]), "not a condition"),
}


def nested(n: int, operation: str, *rest: Any) -> Any:
    tree: Any = "x"
    for _ in range(n):
        tree = [operation, tree, *rest]
    return tree


HOSTILE |= {
    "deep json": ('{"a": ' + "[" * 200_000 + "]" * 200_000 + "}", "nested too deep"),
    "deep expression": (element(value=nested(60, "sin")), "40 levels"),
    "wide expression": (element(value=["+", *[["*", 2, "x"]] * 999]), "more than 2000 terms"),
    "powers of powers": (element(value=nested(30, "^", 100)), "could grow"),
    "brackets": ('{"a": ' + "[]," * 1_000_000 + "1}", "are more than"),
    "commas": ("[" + "1," * 5_000_000 + "1]", "are more than"),
    "bytes": ('{"a": "' + "a" * 33 * 2**20 + '"}', "33.0 MiB is more than"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_documents(name: str) -> None:
    text, message = HOSTILE[name]

    def refused() -> None:
        with pytest.raises(UnusableInput, match=message) as caught:
            from_json(text)
        told.append(str(caught.value))

    told: list[str] = []
    # a reader that follows a bomb makes millions
    assert calls(refused) < 300_000
    (line,) = told
    assert "\n" not in line
    assert line.isascii()
    assert len(line) < 1000


def test_a_million_elements_are_refused_at_once(tmp_path: Path) -> None:
    entry = '{"kind":"0","name":"j%d"}'
    text = '{"schema":"bondsight-graph/1","name":"m","elements":['
    text += ",".join(entry % i for i in range(1_000_000)) + "]}"

    def refused() -> None:
        with pytest.raises(UnusableInput, match="more than the 900000"):
            from_json(text)

    assert calls(refused) < 1000
    large = document(elements=[{"kind": "0", "name": f"j{i}"} for i in range(200_001)], bonds=[])
    with pytest.raises(UnusableInput, match="200001 entries are more than the 200000"):
        from_json(large)


def work(n: int) -> int:
    with BondGraph("chain") as g:
        tail: Element = el.Se("V")
        for i in range(n):
            tail = tail >> el.One(f"j{i}")
            tail >> el.R(f"R{i}", 1.0 + i)
    found: list[BondGraph] = []
    count = calls(lambda: found.append(from_json(to_json(g))))
    assert len(found[0].bonds) == 2 * n
    return count


def test_work_is_linear_in_the_elements() -> None:
    work(500)  # what is imported late
    assert work(4000) < 8 * 1.2 * work(500)


def test_files(tmp_path: Path) -> None:
    file = tmp_path / "rc.json"
    file.write_bytes(b"\xef\xbb\xbf" + document().encode())
    assert_same(from_json(file), from_json(document()))
    assert_same(from_json(str(file)), load_model(str(file)))
    file.write_bytes(b"\xff{}")
    with pytest.raises(UnusableInput, match="not UTF-8"):
        from_json(file)
    for name in ("missing.json", "bad\0name.json", "n" * 5000):
        with pytest.raises(UnusableInput, match="cannot be opened"):
            from_json(str(tmp_path / name))
    with pytest.raises(UnusableInput, match="not a file"):
        from_json(tmp_path)
    with pytest.raises(UnusableInput, match="not a file"):
        from_json("/dev/zero")
    with pytest.raises(UnusableInput, match="cannot be opened"):
        load_model(str(tmp_path / "missing.json"))


def read_or_refused(text: str) -> BondGraph | None:
    """The graph, or None if it was refused in one line; any other error is a failure."""
    try:
        return from_json(text)
    except UnusableInput as error:
        lines = str(error).splitlines()
    assert len(lines) == 1
    return None


JUNK = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=8)
    | st.sampled_from(["a", "R_1", "+", "^", "exp", "where", "dahl", "coulomb", "kind", "law"]),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(
            st.sampled_from(["law", "kind", "value", "operator", "count", "x"]), inner, max_size=3
        )
    ),
    max_leaves=8,
)
SOUND = [json.loads(to_json(every_element())), json.loads(document())] + [
    json.loads(element(law={"law": "operator", "operator": o.to_dict()}))
    for o in (EXAMPLES["ang"], EXAMPLES["al_janaideh"], EXAMPLES["cascade of all"])
]


def places(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    found = [path]
    if isinstance(value, dict | list):
        items = value.items() if isinstance(value, dict) else enumerate(value)
        for k, v in items:
            found += places(v, (*path, k))
    return found


PLACES = [places(d)[1:] for d in SOUND]


@settings(max_examples=250, deadline=None, suppress_health_check=list(HealthCheck))
@given(st.data())
def test_mutated_documents_never_surprise(data: st.DataObject) -> None:
    i = data.draw(st.integers(0, len(SOUND) - 1))
    mutated = json.loads(json.dumps(SOUND[i]))
    for _ in range(data.draw(st.integers(1, 3))):
        *path, last = data.draw(st.sampled_from(PLACES[i]))
        parent = mutated
        try:
            for k in path:
                parent = parent[k]
            if data.draw(st.booleans()):
                parent[last] = data.draw(JUNK)
            else:
                del parent[last]
        except (KeyError, IndexError, TypeError):
            continue
    graph = read_or_refused(json.dumps(mutated))
    if graph is None:
        return
    assert_same(from_json(to_json(graph)), graph)
    VALIDATOR.validate(json.loads(to_json(graph)))


@settings(max_examples=300, deadline=None)
@given(st.data())
def test_mutated_text_never_surprises(data: st.DataObject) -> None:
    text = document()
    i = data.draw(st.integers(0, len(text)))
    j = data.draw(st.integers(i, min(len(text), i + 20)))
    changed = text[:i] + data.draw(st.text(max_size=10)) + text[j:]
    read_or_refused("{" + changed.lstrip("{"))
