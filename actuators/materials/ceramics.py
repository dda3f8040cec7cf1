"""The ceramics of table 2.1 of the stack actuator thesis: printed values, corrections, checks.

Every entry keeps what is printed beside the value to use. `inconsistencies` compares a material
with the relations its own constants must satisfy, so the corrections can be seen, not believed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import sqrt
from types import MappingProxyType
from typing import Literal, TypeAlias, final

from bondgraph.support.errors import require_known

VACUUM_PERMITTIVITY = 8.8541878128e-12  # F/m, CODATA 2018
SOURCE = "stack actuator thesis, table 2.1"

Status: TypeAlias = Literal["printed", "corrected", "doubtful", "memory"]
"""As printed; corrected by the rest of the table; in conflict with it without a certain correction;
corrected from the literature as remembered, not confirmed."""


@final
@dataclass(frozen=True, slots=True)
class MaterialEntry:
    """One cell of the table.

    Attributes
    ----------
    value : float
        SI, with the sign of the physical constant; corrected where `status` says so.
    unit : str
        SI unit; ``1`` for ratios.
    printed : float
        The number in the table.
    printed_unit : str
        The unit of `printed`; a leading ``-`` means that the table prints the constant negated.
    status : {"printed", "corrected", "doubtful", "memory"}
    note : str
        Why the value is not the printed one, or is in doubt.
    """

    value: float
    unit: str
    printed: float
    printed_unit: str
    status: Status = "printed"
    note: str = ""


@final
@dataclass(frozen=True)
class Ceramic:
    """A ceramic by name; ``material["d33"]`` is a `MaterialEntry`, or None where there is none.

    Examples
    --------
    >>> from actuators import material
    >>> pic = material("PIC255")
    >>> pic.name, pic["d33"].value
    ('PIC255', 4e-10)
    """

    name: str
    entries: Mapping[str, MaterialEntry | None]
    source: str = SOURCE

    def __getitem__(self, symbol: str) -> MaterialEntry | None:
        """Entry by symbol; None if the table leaves it out."""
        require_known("constant", self.name, self.entries, symbol)
        return self.entries[symbol]

    def value(self, symbol: str, *, printed: bool = False) -> float | None:
        """Return a constant in SI, corrected or as printed; None if the table leaves it out."""
        entry = self[symbol]
        if entry is None:
            return None
        return _si(symbol, entry.printed) if printed else entry.value

    def __str__(self) -> str:
        """Return the constants one a line."""
        lines = [f"{self.name} ({self.source})"]
        for symbol, entry in self.entries.items():
            if entry is None:
                lines.append(f"{symbol:>14}  -")
                continue
            more = "" if entry.status == "printed" else f"  {entry.status}: {entry.note}"
            lines.append(f"{symbol:>14}  {entry.value:<10.4g} {entry.unit}{more}")
        return "\n".join(lines)


# symbol -> SI unit, printed unit, scale, offset
_ROWS: dict[str, tuple[str, str, float, float]] = {
    "density": ("kg/m^3", "g/cm^3", 1e3, 0.0),
    "T_Curie": ("K", "degC", 1.0, 273.15),
    "kp": ("1", "1", 1.0, 0.0),
    "k33": ("1", "1", 1.0, 0.0),
    "k31": ("1", "1", 1.0, 0.0),
    "k15": ("1", "1", 1.0, 0.0),
    "d33": ("m/V", "pm/V", 1e-12, 0.0),
    "d31": ("m/V", "-pm/V", -1e-12, 0.0),
    "d15": ("m/V", "pm/V", 1e-12, 0.0),
    "g33": ("V*m/N", "mV*m/N", 1e-3, 0.0),
    "g31": ("V*m/N", "-mV*m/N", -1e-3, 0.0),
    "g15": ("V*m/N", "mV*m/N", 1e-3, 0.0),
    "s11": ("m^2/N", "um^2/N", 1e-12, 0.0),
    "s33": ("m^2/N", "um^2/N", 1e-12, 0.0),
    "N_P": ("Hz*m", "Hz*m", 1.0, 0.0),
    "N_L": ("Hz*m", "Hz*m", 1.0, 0.0),
    "N_T": ("Hz*m", "Hz*m", 1.0, 0.0),
    "eps33": ("F/m", "eps_0", VACUUM_PERMITTIVITY, 0.0),
    "eps11": ("F/m", "eps_0", VACUUM_PERMITTIVITY, 0.0),
    "Q_m": ("1", "1", 1.0, 0.0),
    "tan_delta": ("1", "%", 1e-2, 0.0),
}

_PRINTED: dict[str, tuple[float | None, ...]] = {
    "PIC140": (
        7.6, 330, 0.5, 0.6, 0.325, None, 200, 60, 265, 28.2, 8.5, None, 11.7, 11.7,
        2200, 1680, 2100, 1200, 680, 350, 1,
    ),
    "PIC255": (
        7.8, 350, 0.62, 0.35, 0.69, None, 400, 180, 560, 25.1, 11.3, None, 16.1, 20.7,
        2000, 1420, 2000, 1750, None, 80, 1.5,
    ),
    "BM532": (
        7.65, 210, 0.65, 0.75, 0.39, None, 590, 270, None, 20, 9, None, 14, 20,
        2000, 1425, 1850, 3250, None, 70, 2,
    ),
    "APC855": (
        7.7, 250, 0.68, 0.76, 0.40, 0.66, 630, 276, 720, 21, 9, 27, 16.9, 19.6,
        1390, 2079, 1920, 3300, None, 65, 1.3,
    ),
}  # fmt: skip

_SWAPPED = "k33 and k31 are printed in each other's row; d33, d31, s and eps33 give 0.71 and 0.36"
_G140 = (
    "{} is {} mV*m/N; d33, s33 and eps33 agree with k33, so the voltage constant is the odd one "
    "(both printed ones fit eps33 = 800 eps_0 instead)"
)
_N855 = (
    "the three constants are permuted: 1/(2 sqrt(density s11)) = 1386 Hz*m is N_L; which of the "
    "others is N_P and which N_T is from memory, not confirmed"
)

# (material, symbol) -> value in the printed unit, status, note
_CORRECTIONS: dict[tuple[str, str], tuple[float, Status, str]] = {
    ("PIC255", "k33"): (0.69, "corrected", _SWAPPED),
    ("PIC255", "k31"): (0.35, "corrected", _SWAPPED),
    ("PIC140", "g33"): (18.8, "corrected", _G140.format("d33/eps33", 18.8)),
    ("PIC140", "g31"): (5.65, "corrected", _G140.format("-d31/eps33", 5.65)),
    ("PIC140", "k31"): (
        0.325, "doubtful", "d31, s11 and eps33 give 0.17; the table does not tell which is wrong",
    ),
    ("APC855", "N_P"): (1920, "memory", _N855),
    ("APC855", "N_L"): (1390, "corrected", _N855),
    ("APC855", "N_T"): (2079, "memory", _N855),
}  # fmt: skip


def _si(symbol: str, printed: float) -> float:
    _, _, scale, offset = _ROWS[symbol]
    return printed * scale + offset


def _entry(name: str, symbol: str, printed: float | None) -> MaterialEntry | None:
    if printed is None:
        return None
    unit, printed_unit, _, _ = _ROWS[symbol]
    best, status, note = _CORRECTIONS.get((name, symbol), (printed, "printed", ""))
    return MaterialEntry(_si(symbol, best), unit, float(printed), printed_unit, status, note)


def _material(name: str) -> Ceramic:
    cells = zip(_ROWS, _PRINTED[name], strict=True)
    return Ceramic(name, MappingProxyType({s: _entry(name, s, v) for s, v in cells}))


MATERIALS: Mapping[str, Ceramic] = MappingProxyType({n: _material(n) for n in _PRINTED})
"""The ceramics of the table by name."""


def material(name: str) -> Ceramic:
    """Return a ceramic of the table by name.

    Raises
    ------
    UnknownName
        With the nearest names.

    Examples
    --------
    >>> material("PIC255").value("k33"), material("PIC255").value("k33", printed=True)
    (0.69, 0.35)
    >>> material("BM532").value("d15") is None
    True
    """
    require_known("material", SOURCE, MATERIALS, name)
    return MATERIALS[name]


@final
@dataclass(frozen=True, slots=True)
class ConstantRelation:
    """A constant that follows from others: ``symbol = formula`` of `inputs`, all SI."""

    symbol: str
    formula: str
    inputs: tuple[str, ...]
    function: Callable[..., float]


RELATIONS: tuple[ConstantRelation, ...] = (
    ConstantRelation("g33", "d33 / eps33", ("d33", "eps33"), lambda d, e: d / e),
    ConstantRelation("g31", "d31 / eps33", ("d31", "eps33"), lambda d, e: d / e),
    ConstantRelation("g15", "d15 / eps11", ("d15", "eps11"), lambda d, e: d / e),
    ConstantRelation(
        "k33", "d33 / sqrt(s33 eps33)", ("d33", "s33", "eps33"), lambda d, s, e: d / sqrt(s * e)
    ),
    ConstantRelation(
        "k31", "|d31| / sqrt(s11 eps33)", ("d31", "s11", "eps33"), lambda d, s, e: -d / sqrt(s * e)
    ),
    ConstantRelation(
        "N_L", "1 / (2 sqrt(density s11))", ("density", "s11"), lambda r, s: 0.5 / sqrt(r * s)
    ),
)
"""What the constants of one material must satisfy (IEEE Std 176; a bar in length mode for N_L)."""


@final
@dataclass(frozen=True, slots=True)
class Inconsistency:
    """A stated constant that differs from the one its companions give; SI."""

    material: str
    symbol: str
    stated: float
    computed: float
    formula: str

    @property
    def relative(self) -> float:
        """Return ``stated / computed - 1``."""
        return self.stated / self.computed - 1.0

    def __str__(self) -> str:
        """One line."""
        return (
            f"{self.material}: {self.symbol} = {self.stated:.4g} but {self.formula} = "
            f"{self.computed:.4g} ({100 * self.relative:+.0f} %)"
        )


def inconsistencies(
    subject: Ceramic, *, tolerance: float = 0.1, printed: bool = False
) -> tuple[Inconsistency, ...]:
    """Compare a material with `RELATIONS`; a relation with a missing constant is passed over.

    Parameters
    ----------
    subject : Ceramic
    tolerance : float
        Relative difference still accepted; data sheets of ceramics promise 10 %.
    printed : bool
        Judge the table as printed instead of the corrected values.

    Returns
    -------
    tuple of Inconsistency
        In the order of `RELATIONS`; which member of a relation is wrong they cannot say.

    Examples
    --------
    >>> [i.symbol for i in inconsistencies(material("PIC255"), printed=True)]
    ['k33', 'k31']
    """
    found = []
    for relation in RELATIONS:
        stated = subject.value(relation.symbol, printed=printed)
        known = [subject.value(n, printed=printed) for n in relation.inputs]
        given = [v for v in known if v is not None]
        if stated is None or len(given) < len(known):
            continue
        item = Inconsistency(
            subject.name, relation.symbol, stated, relation.function(*given), relation.formula
        )
        if abs(item.relative) > tolerance:
            found.append(item)
    return tuple(found)
