"""The comparison sees what it must see, and leaves out what took time."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.proof.unchanged.compare import Rules, main, of_texts, of_values, rules_by_command

BEFORE = {
    "1.out.txt": "k = 1999.97738 N/m, 8 steps\n9.0 s\nverdict: out/verdict.json\n",
    "result.json": json.dumps({"steps": [{"exit": "0", "seconds": 3.1}], "kept": ["v.json"]}),
    "files/v.json": json.dumps({"effect": "delay", "value": 0.1, "seconds": 9.0, "n": [1, 2]}),
}
CHANGES = {
    "a number": ("1.out.txt", "1999.97738", "1999.98738"),
    "a whole number": ("1.out.txt", "8 steps", "9 steps"),
    "a word": ("1.out.txt", "N/m", "N*m"),
    "a new line": ("1.out.txt", "9.0 s", "9.0 s\nnote: more"),
    "an exit code": ("result.json", '"exit": "0"', '"exit": "2"'),
    "a value of a file": ("files/v.json", "0.1", "0.10001"),
    "a name of a file": ("files/v.json", "delay", "low_pass"),
    "an entry less": ("files/v.json", "[1, 2]", "[1]"),
    "a key less": ("files/v.json", '"value": 0.1, ', ""),
    "not a number": ("files/v.json", "0.1", "NaN"),
    "another type": ("files/v.json", "0.1", '"0.1"'),
}
SAME = {
    "the time of a diagnosis": ("1.out.txt", "9.0 s", "12.4 s"),
    "seconds of a command": ("result.json", "3.1", "4.7"),
    "seconds in a file": ("files/v.json", "9.0", "9.5"),
    "a digit within the tolerance": ("files/v.json", "0.1,", "0.10000000001,"),
}


def recording(folder: Path, texts: dict[str, str]) -> Path:
    for name, text in texts.items():
        path = folder / "command" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return folder


def changed(change: tuple[str, str, str]) -> dict[str, str]:
    name, old, new = change
    assert old in BEFORE[name]
    return {**BEFORE, name: BEFORE[name].replace(old, new)}


@pytest.mark.parametrize("what", CHANGES)
def test_a_change_is_reported(
    what: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    a = recording(tmp_path / "a", BEFORE)
    b = recording(tmp_path / "b", changed(CHANGES[what]))
    assert main([str(a), str(b)]) == 1
    assert f"command/{CHANGES[what][0]}: " in capsys.readouterr().out


@pytest.mark.parametrize("what", SAME)
def test_what_may_differ_is_left_out(what: str, tmp_path: Path) -> None:
    a, b = recording(tmp_path / "a", BEFORE), recording(tmp_path / "b", changed(SAME[what]))
    assert main([str(a), str(b)]) == 0


def test_exact_has_no_tolerance(tmp_path: Path) -> None:
    change = SAME["a digit within the tolerance"]
    a, b = recording(tmp_path / "a", BEFORE), recording(tmp_path / "b", changed(change))
    assert main([str(a), str(b), "--exact"]) == 1


def test_a_file_or_a_command_that_is_missing_is_reported(tmp_path: Path) -> None:
    a = recording(tmp_path / "a", BEFORE)
    b = recording(tmp_path / "b", {n: t for n, t in BEFORE.items() if n != "files/v.json"})
    assert main([str(a), str(b)]) == 1
    (tmp_path / "none").mkdir()
    assert main([str(a), str(tmp_path / "none")]) == 1
    assert main([str(tmp_path / "none"), str(tmp_path / "none")]) == 1


def test_a_rename_is_accepted_only_where_it_is_stated() -> None:
    a, b = "by Estimation of m", "by Estimate of m"
    assert list(of_texts(a, b, Rules()))
    assert not list(of_texts(a, b, Rules(renames=(("Estimation", "Estimate"),))))


def test_indentation_counts() -> None:
    assert list(of_texts("if a:\n    b", "if a:\n  b", Rules()))


def test_line_breaks_count_unless_the_command_wraps() -> None:
    assert list(of_texts("one two\nthree", "one\ntwo three", Rules()))
    assert not list(of_texts("one two\nthree", "one\ntwo three", Rules(wrapped=True)))
    assert list(of_texts("one two\nthree", "one\ntwo four", Rules(wrapped=True)))


def test_the_order_of_keys_counts() -> None:
    assert list(of_values({"a": 1, "b": 2}, {"b": 2, "a": 1}, Rules()))


def test_each_command_has_its_own_rules() -> None:
    names = [
        "diagnose-coulomb",
        "diagnose-real-motor-board1_steps",
        "identifiability-models_drives",
    ]
    found = rules_by_command(names, Rules())
    assert set(found) == set(names)
    assert [found[n].wrapped for n in names] == [True, False, False]
