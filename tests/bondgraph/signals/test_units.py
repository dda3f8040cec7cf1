"""Units, domains and error messages."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bondgraph.graph import domains
from bondgraph.signals import units
from bondgraph.signals.quantity import quantity
from bondgraph.signals.units import convert, meant_by, parse_unit, read_unit, split_header
from bondgraph.support import errors
from bondgraph.support.errors import BondsightError, UnknownName, UnusableInput, unknown_name

CASES = [
    ("um", 1e-6, "m"),
    ("\u00b5m", 1e-6, "m"),
    ("kg", 1.0, "kg"),
    ("mg", 1e-6, "kg"),
    ("N/V", 1.0, "N/V"),
    ("N*s/m", 1.0, "N*s/m"),
    ("N s/m", 1.0, "N*s/m"),
    ("N/(m*s)", 1.0, "N/m/s"),
    ("uC/V", 1e-6, "C/V"),
    ("m/s^2", 1.0, "m/s^2"),
    ("m s-2", 1.0, "m/s^2"),
    ("m_s2", 1.0, "m/s^2"),
    ("rad_s", 1.0, "rad/s"),
    ("m3_s", 1.0, "m^3/s"),
    ("1/s", 1.0, "1/s"),
    ("%", 0.01, "1"),
    ("mm/m", 1e-3, "1"),
    ("ohm", 1.0, "ohm"),
    ("k\u03a9", 1e3, "ohm"),
    ("deg", math.pi / 180, "rad"),
    ("rpm", 2 * math.pi / 60, "rad/s"),
    ("bar", 1e5, "Pa"),
    ("hPa", 100.0, "Pa"),
    ("cm_per_s", 0.01, "m/s"),
    ("uC_per_cm2", 0.01, "C/m^2"),
    ("l/min", 1e-3 / 60, "m^3/s"),
    ("km/h", 1 / 3.6, "m/s"),
    ("g0", 9.80665, "m/s^2"),
    ("Nm", 1.0, "N*m"),
    ("min", 60.0, "s"),
]


@pytest.mark.parametrize(("text", "scale", "si"), CASES)
def test_unit(text: str, scale: float, si: str) -> None:
    unit = parse_unit(text)
    assert unit.scale == pytest.approx(scale, rel=1e-14)
    assert unit.si == si
    assert parse_unit(unit.si).scale == 1.0
    assert parse_unit(unit.si).dims == unit.dims


@pytest.mark.parametrize(
    "text",
    [
        "",
        "foo",
        "N_m",
        "m^",
        "m^1.5",
        "(m",
        "m)",
        "umm",
        "m*",
        "*m",
        "m//s",
        "m^99",
        "m" * 70,
        "1e3",
    ],
)
def test_bad_unit_is_one_line(text: str) -> None:
    with pytest.raises(UnusableInput, match="unit ") as info:
        parse_unit(text, "a.csv, column 'x'")
    assert "a.csv" in str(info.value)
    assert "\n" not in str(info.value)


def test_nearest_unit_is_named() -> None:
    with pytest.raises(UnusableInput, match="'um'"):
        parse_unit("umm")


def test_degc_carries_a_note() -> None:
    assert "273.15" in parse_unit("degC").note
    assert parse_unit("W/degC").note
    assert parse_unit("\u00b0C").si == "K"


@given(st.text(max_size=20))
def test_any_text_is_a_unit_or_an_error(text: str) -> None:
    try:
        unit = parse_unit(text)
    except UnusableInput:
        return
    assert 0.0 < unit.scale < math.inf


stems = st.sampled_from(["m", "um", "N", "V", "s", "ohm", "kPa", "rad", "mA", "K", "rpm", "%"])
factor = st.tuples(stems, st.integers(-3, 3).filter(bool))


@given(st.lists(factor, min_size=1, max_size=4))
def test_products_multiply(parts: list[tuple[str, int]]) -> None:
    whole = parse_unit("*".join(f"{s}^{k}" for s, k in parts))
    scale = math.prod(parse_unit(s).scale ** k for s, k in parts)
    dims = tuple(sum(parse_unit(s).dims[i] * k for s, k in parts) for i in range(5))
    assert whole.scale == pytest.approx(scale, rel=1e-11)
    assert whole.dims == dims
    assert parse_unit(whole.si).dims == dims
    assert parse_unit(whole.si).scale == 1.0


@given(st.floats(-1e6, 1e6), st.sampled_from([c[0] for c in CASES]))
def test_there_and_back(value: float, text: str) -> None:
    unit = parse_unit(text)
    assert float(unit.from_si(unit.to_si(value))) == pytest.approx(value, rel=1e-14, abs=1e-300)


def test_convert_checks_dimensions() -> None:
    assert convert([1.0, 2.0], "mm", "um") == pytest.approx([1e3, 2e3])
    with pytest.raises(UnusableInput, match="cannot convert 'mm' to 's'"):
        convert(1.0, "mm", "s")


@pytest.mark.parametrize(
    ("header", "expected"),
    [
        ("x[um]", ("x", "um")),
        (" x [um] ", ("x", "um")),
        ("x (um)", ("x", "um")),
        ("displacement_um", ("displacement", "um")),
        ("angular_velocity_rad_per_s", ("angular_velocity", "rad_per_s")),
        ("acc1_m_s2", ("acc1", "m_s2")),
        ("snls80mV_u_V", ("snls80mV_u", "V")),
        ("polarization_uC_per_cm2", ("polarization", "uC_per_cm2")),
        ("rate_per_s", ("rate", "per_s")),
        ("torque_N_m", ("torque", "N_m")),
        ("x", ("x", None)),
        ("y1", ("y1", None)),
        ("x_1", ("x_1", None)),
        ("u_V2", ("u_V2", None)),
        ("area_mm2", ("area", "mm2")),
        ("um", ("um", None)),
    ],
)
def test_split_header(header: str, expected: tuple[str, str | None]) -> None:
    assert split_header(header) == expected


@pytest.mark.parametrize("name", sorted(domains.DOMAINS))
def test_domain_variables_agree(name: str) -> None:
    domain = domains.DOMAINS[name]
    second, watt = parse_unit("s"), parse_unit("W")
    if not domain.pseudo:
        power = parse_unit(f"({domain.effort.unit})*({domain.flow.unit})")
        assert power.dims == watt.dims
        assert power.scale == 1.0
    if name != "generic":
        for whole, rate in ((domain.displacement, domain.flow), (domain.momentum, domain.effort)):
            expected = [a + b for a, b in zip(rate.parsed.dims, second.dims, strict=True)]
            assert list(whole.parsed.dims) == expected


def test_domain_names() -> None:
    assert domains.domain("Mechanical_Rotation").flow.unit == "rad/s"
    with pytest.raises(UnknownName, match="Did you mean 'electrical'"):
        domains.domain("electricl")


@pytest.mark.parametrize("kind", [UnknownName, UnusableInput, errors.GraphError, BondsightError])
def test_errors_are_plain_lines(kind: type[BondsightError]) -> None:
    error = kind("one\nline")
    assert str(error) == "one line"
    assert str(pickle.loads(pickle.dumps(error))) == "one line"
    assert isinstance(error, BondsightError)


def test_unknown_name_shows_nearest_and_known() -> None:
    error = unknown_name("parameter", "Ra", "dc_motor", ["R_a", "L_a", "K_t"])
    assert isinstance(error, KeyError)
    assert str(error) == ("no parameter 'Ra' in dc_motor. Did you mean 'R_a'? Known: R_a, L_a, K_t")
    long = str(unknown_name("x", "q" * 5000, "", ["a"]))
    assert long == f"no x '{'q' * 77}...'. Known: a"
    assert "(40 in all)" in str(unknown_name("x", "q", "", [f"n{i}" for i in range(40)]))
    assert "Known: none" in str(unknown_name("x", "q", "", []))


def test_units_are_frozen() -> None:
    with pytest.raises(AttributeError):
        parse_unit("m").scale = 2.0  # type: ignore[misc]
    assert units.parse_unit("m") is units.parse_unit("m")
    assert np.asarray(parse_unit("um").to_si([1, 2])).dtype == np.float64


@pytest.mark.parametrize("text", ["10 rev/s", "600 rev/min", "3600 deg/s", "63 rad/s", "600rpm"])
def test_an_angular_rate_is_no_frequency(text: str) -> None:
    with pytest.raises(UnusableInput, match="an angular unit; give cycles per second, Hz"):
        quantity(text, "Hz", "--frequency")
    assert quantity("10 1/s", "Hz", "--frequency") == 10.0


@pytest.mark.parametrize(("written", "symbol"), [("Farad", "F"), ("volts", "V"), ("Henry", "H")])
def test_a_unit_that_is_written_out_is_told_by_its_symbol(written: str, symbol: str) -> None:
    with pytest.raises(UnusableInput, match=f"did you mean '{symbol}'"):
        parse_unit(written)


@pytest.mark.parametrize(
    ("tail", "meant"),
    [
        ("mQ", ("mA", "mV", "mN")), ("rmp", ("rpm",)), ("kPA", ("kPa",)), ("kn", ("kN",)),
        ("volts", ("V",)), ("lpm", ("l/min",)), ("cmd", ()), ("ref", ()), ("dc", ()), ("a", ()),
        ("V2", ()), ("left", ()),
    ],
)  # fmt: skip
def test_what_a_misspelled_unit_may_mean(tail: str, meant: tuple[str, ...]) -> None:
    assert meant_by(tail) == meant
    assert all(read_unit(k) for k in meant)
