"""Plain data by the annotations of dataclasses: what is accepted, and one line for what is not."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
import pytest

from bondgraph.support.bounds import Count, Name, NonNegative, Positive, Rising, least, one_of
from bondgraph.support.errors import UnusableInput
from bondgraph.support.typed_reader import Rules, off_default, read, record


@dataclass(frozen=True)
class Inner:
    size: Positive
    way: Annotated[str, one_of("up", "down")] = "up"


@dataclass(frozen=True)
class Outer:
    name: Name
    inner: Inner
    pair: tuple[float, str] = (0.0, "")
    many: tuple[Inner, ...] = ()
    either: Inner | float | None = None
    table: Mapping[str, NonNegative] | None = None
    knots: Rising = (0.0, 1.0)
    words: Annotated[tuple[str, ...], least(1)] = ("a",)
    number: Count = 0

    def __post_init__(self) -> None:
        if self.name == "raises":
            raise ZeroDivisionError
        if self.name == "refuses":
            raise UnusableInput("this name is taken")


GOOD: dict[str, Any] = {
    "name": "a", "inner": {"size": 1}, "pair": [2, "m"], "many": [{"size": 2.5, "way": "down"}],
    "either": {"size": 3}, "table": {"x": 0}, "knots": [0, 2], "words": ["b"], "number": 4,
}  # fmt: skip


def test_every_kind_of_annotation() -> None:
    found = record(Outer, GOOD, "file")
    assert found == Outer(
        "a", Inner(1), (2, "m"), (Inner(2.5, "down"),), Inner(3), {"x": 0}, (0, 2), ("b",), 4
    )
    assert type(found.inner.size) is int
    assert record(Outer, {**GOOD, "either": 0.5}, "file").either == 0.5
    assert record(Outer, {**GOOD, "either": None}, "file").either is None
    assert type(read(float, np.float64(2.0), "file")) is float
    assert dict(off_default(found.many[0])) == {"size": 2.5, "way": "down"}


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"nane": 1}, "file: no field of Outer 'nane'; did you mean 'name'"),
        ({"name": "1a"}, "file.name: '1a' is not a name"),
        ({"name": "raises"}, "file: ZeroDivisionError"),
        ({"name": "refuses"}, "file: this name is taken"),
        ({"inner": 3}, "file.inner: 3 is not an object (Inner)"),
        ({"inner": {}}, "file.inner: Inner needs its field 'size'"),
        ({"inner": {"size": 0}}, "file.inner.size: 0 is not a number above 0"),
        ({"inner": {"size": float("nan")}}, "file.inner.size: nan is not a finite number"),
        ({"inner": {"size": 2**53 + 1}}, "is not a whole number within 2**53"),
        ({"inner": {"size": 1, "way": "dow"}}, "is not one of up, down; did you mean 'down'?"),
        ({"pair": [1.0]}, "file.pair: 1 entries, 2 are needed"),
        ({"pair": [1.0, 2.0]}, "file.pair[1]: 2.0 is not text"),
        ({"many": {}}, "file.many: an object is not a list"),
        ({"many": [{"size": 1}, {"size": "1"}]}, "file.many[1].size: '1' is not a number"),
        ({"many": [{"size": 1}] * 100_001}, "file.many: 100001 entries are more than the 100000"),
        ({"either": "x"}, "file.either: 'x' is not a number"),
        ({"table": {"x": -1}}, "file.table.x: -1 is not a number of at least 0"),
        ({"table": {3: 1}}, "file.table: 3 is not text"),
        ({"knots": [0]}, "file.knots: a list is not long enough: at least 2 entries"),
        ({"knots": [1, 1]}, "file.knots: a list is not in rising order"),
        ({"words": []}, "file.words: a list is not long enough"),
        ({"words": ["\x1b"]}, "file.words[0]: '\\x1b' is not printable text"),
        ({"words": ["a" * 2001]}, "file.words[0]: 2001 signs are more than the 2000"),
        ({"number": True}, "file.number: true is not a whole number"),
        ({"number": 1.0}, "file.number: 1.0 is not a whole number"),
        ({"number": -1}, "file.number: -1 is not a whole number of at least 0"),
    ],
)
def test_each_refusal_is_one_line_with_its_place(change: dict[str, Any], said: str) -> None:
    with pytest.raises(UnusableInput) as caught:
        record(Outer, {**GOOD, **change}, "file")
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith("file")


def test_rules() -> None:
    assert record(Inner, {"size": 1, "new": 2}, "file", Rules(surplus=True)) == Inner(1)
    with pytest.raises(UnusableInput, match="Inner needs its field 'way'"):
        record(Inner, {"size": 1}, "file", Rules(complete=True))
    doubled = Rules({float: lambda _, value, place: 2 * read(float, value, place)})
    assert record(Inner, {"size": 1}, "file", doubled) == Inner(2)
    loose = Rules({str: lambda _, value, place: value})
    with pytest.raises(UnusableInput, match=r"^file\.\\x1b: -1 is not"):
        read(Mapping[str, NonNegative], {"\x1b": -1}, "file", loose)
    made = Rules({Inner: lambda kind, value, place: kind(value)})
    assert record(Outer, {"name": "a", "inner": 7}, "file", made).inner == Inner(7)


def test_literals_take_their_choices_only() -> None:
    kind = Literal["N", 1, None]
    assert [read(kind, v, "file") for v in ("N", 1, None)] == ["N", 1, None]
    wrong: tuple[Any, ...] = ("E", True, 1.0, 2, [], {"N": 1})
    for value in wrong:
        with pytest.raises(UnusableInput, match=r"^file: .* is not one of 'N', 1, null$"):
            read(kind, value, "file")


def test_lists_and_mappings() -> None:
    assert read(list[int], (1, 2), "file") == [1, 2]
    assert read(list[int], [], "file") == []
    assert read(dict[str, int], {"a": 1}, "file") == {"a": 1}
    with pytest.raises(UnusableInput, match=r"^file\[1\]: '2' is not a whole number$"):
        read(list[int], [1, "2"], "file")
    with pytest.raises(UnusableInput, match=r"^file: an object is not a list$"):
        read(list[int], {}, "file")


@pytest.mark.parametrize("kind", [complex, object, bytes, list, dict, set[int], type[int]])
def test_an_annotation_without_a_reader_is_the_programs_mistake(kind: Any) -> None:
    with pytest.raises(TypeError, match=r"^file: no reader for the annotation"):
        read(kind, {}, "file")


def test_whole_numbers_are_exact_floats() -> None:
    assert read(int, -(2**53), "file") == -(2**53)
    for value in (2**53 + 1, -(10**400)):
        with pytest.raises(UnusableInput, match=r"is not a whole number within 2\*\*53$"):
            read(int, value, "file")


def test_the_outermost_place_may_be_empty() -> None:
    for data, said in (
        ({"size": -1}, "size: -1 is not"),
        ({}, "Inner needs"),
        (3, "the whole file:"),
    ):
        with pytest.raises(UnusableInput, match=f"^{said}"):
            record(Inner, data, "")
