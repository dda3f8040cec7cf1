"""Table 2.1: what is printed, what is corrected, and that computation finds the difference."""

from __future__ import annotations

import doctest

import pytest

import actuators.materials.ceramics as module
from actuators.materials.ceramics import MATERIALS, VACUUM_PERMITTIVITY, inconsistencies, material
from bondgraph import UnknownName


def found(name: str, *, printed: bool) -> set[str]:
    return {i.symbol for i in inconsistencies(material(name), printed=printed)}


def test_examples_run() -> None:
    assert doctest.testmod(module).failed == 0


def test_values_and_units() -> None:
    pic255 = material("PIC255")
    d31, eps = pic255["d31"], pic255["eps33"]
    assert d31 is not None
    assert eps is not None
    assert (d31.value, d31.unit, d31.printed) == (-180e-12, "m/V", 180)
    assert eps.value == pytest.approx(1750 * VACUUM_PERMITTIVITY)
    assert material("PIC140").value("T_Curie") == pytest.approx(603.15)
    assert material("BM532").value("density") == pytest.approx(7650.0)
    assert material("APC855").value("tan_delta") == pytest.approx(0.013)


def test_missing_entries_are_none() -> None:
    assert material("PIC255")["k15"] is None
    assert material("BM532").value("d15") is None
    assert material("APC855").value("eps11") is None


def test_lookup_names_the_nearest() -> None:
    with pytest.raises(UnknownName, match=r"no material 'PIC25'.*Did you mean 'PIC255'"):
        material("PIC25")
    with pytest.raises(UnknownName, match=r"no constant 'd_33' in PIC255.*'d33'"):
        material("PIC255")["d_33"]


def test_computation_finds_the_misprints() -> None:
    assert found("PIC255", printed=True) == {"k33", "k31"}
    assert found("PIC140", printed=True) == {"g33", "g31", "k31"}
    assert found("APC855", printed=True) == {"N_L"}
    assert found("BM532", printed=True) == set()


def test_corrected_table_leaves_only_what_is_in_doubt() -> None:
    for name, subject in MATERIALS.items():
        left = found(name, printed=False)
        doubtful = {s for s, e in subject.entries.items() if e and e.status == "doubtful"}
        assert left == doubtful


def test_numbers_of_the_corrections() -> None:
    (g33,) = (i for i in inconsistencies(material("PIC140"), printed=True) if i.symbol == "g33")
    assert g33.computed == pytest.approx(18.8e-3, abs=0.05e-3)
    assert g33.relative == pytest.approx(0.498, abs=0.002)
    assert "g33 = 0.0282 but d33 / eps33 = 0.01882 (+50 %)" in str(g33)
    apc = material("APC855")
    for symbol, value, status in (
        ("N_L", 1390, "corrected"), ("N_T", 2079, "memory"), ("N_P", 1920, "memory"),
    ):  # fmt: skip
        entry = apc[symbol]
        assert entry is not None
        assert (entry.value, entry.status) == (value, status)
    assert sorted(e.printed for s in ("N_P", "N_L", "N_T") if (e := apc[s])) == [1390, 1920, 2079]


def test_every_change_is_explained() -> None:
    for subject in MATERIALS.values():
        for symbol, entry in subject.entries.items():
            if entry is None:
                continue
            changed = entry.value != pytest.approx(subject.value(symbol, printed=True))
            assert changed == (entry.status in ("corrected", "memory"))
            assert bool(entry.note) == (entry.status != "printed")
    assert "corrected" in str(material("PIC255"))
