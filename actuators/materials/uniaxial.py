"""The constants of a piezoelectric material that matter along its poling axis, in four forms.

One-dimensional forms of the table in `actuators.materials.constitutive`, for a bar with free sides
or a plate with clamped ones. Numbers and expressions are treated alike.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import Any, Literal, TypeAlias, final

from actuators.materials.constitutive import (
    ELECTRICAL,
    FORMS,
    MECHANICAL,
    BadConstant,
    Form,
    Piezoelectric,
    exchanges,
)
from bondgraph.support.errors import UnusableInput, require_known

Sides: TypeAlias = Literal["free", "clamped"]


def number_of(value: Any) -> float | None:
    """Return a number as a float, None for an expression with symbols."""
    return None if getattr(value, "free_symbols", ()) else float(value)


@final
@dataclass(frozen=True, slots=True)
class Uniaxial:
    """The constants that matter along the poling axis, in one of the four forms.

    Parameters
    ----------
    form : {"d", "e", "g", "h"}
    elastic : number or expression
        Compliance (m^2/N) in forms d and g, stiffness (N/m^2) in e and h. With free sides these
        belong to a slender bar: ``c = 1/s``, not the c_33 of the plate.
    coupling : number or expression
        d (m/V), e (C/m^2), g (V m/N) or h (V/m).
    dielectric : number or expression
        Permittivity (F/m) in forms d and e, its inverse (m/F) in g and h.

    Raises
    ------
    BadConstant
        A number is not finite, an elastic or dielectric one not positive, or the coupling factor
        reaches 1, so that the energy has no lowest value. Expressions are not judged.

    Examples
    --------
    >>> bar = Uniaxial("d", 20.7e-12, 400e-12, 1.55e-8)
    >>> round(float(bar.coupling_squared), 3), round(bar.to("e").coupling, 2)
    (0.499, 19.32)
    """

    form: Form
    elastic: Any
    coupling: Any
    dielectric: Any

    def __post_init__(self) -> None:
        """Refuse numbers that no material can have."""
        require_known("form", "the constitutive equations", FORMS, self.form)
        for name, value, positive in zip(self.names, self.values, (1, 0, 1), strict=True):
            number = number_of(value)
            if number is not None and not (isfinite(number) and (number > 0 or not positive)):
                raise BadConstant(
                    f"{name} = {number:g} must be finite{' and positive' if positive else ''}; "
                    f"check its sign and its SI unit (form {self.form})"
                )
        square = number_of(self.coupling_squared)
        if square is not None and not square < 1.0:
            raise BadConstant(
                f"k^2 = {square:.4g}: a coupling factor lies below 1, or the energy has no lowest "
                f"value; {self.names[1]} is too large for {self.names[0]} and {self.names[2]}, "
                "check the units"
            )

    @property
    def names(self) -> tuple[str, str, str]:
        """Names of the three constants."""
        return FORMS[self.form]

    @property
    def values(self) -> tuple[Any, Any, Any]:
        """Elastic, coupling and dielectric constant."""
        return self.elastic, self.coupling, self.dielectric

    @property
    def coupling_squared(self) -> Any:
        """``k^2``: part of the energy given at one port that the other can take.

        ``d^2/(s^E eps^T)``, ``h^2/(c^D beta^S)``; in forms e and g the square over itself plus the
        product, and so below 1 for any constants.
        """
        square, product = self.coupling**2, self.elastic * self.dielectric
        return square / product if self.form in "dh" else square / (product + square)

    def to(self, form: Form) -> Uniaxial:
        """Return the same material in another form."""
        mechanical, electrical = exchanges(self.form, form)
        same = self._exchanged_mechanical() if mechanical else self
        return same._exchanged_electrical() if electrical else same

    def _exchanged_mechanical(self) -> Uniaxial:
        k = self.coupling / self.elastic
        form, sign = MECHANICAL[self.form]
        return Uniaxial(form, 1 / self.elastic, k, self.dielectric + sign * k * self.coupling)

    def _exchanged_electrical(self) -> Uniaxial:
        k = self.coupling / self.dielectric
        form, sign = ELECTRICAL[self.form]
        return Uniaxial(form, self.elastic + sign * k * self.coupling, k, 1 / self.dielectric)


def uniaxial(material: Piezoelectric, form: Form = "d", sides: Sides = "free") -> Uniaxial:
    """Return the constants of axis 3 from those of the whole material.

    Parameters
    ----------
    material : Piezoelectric
        In any form.
    form : {"d", "e", "g", "h"}
        Of the result.
    sides : {"free", "clamped"}
        ``T1 = T2 = 0``, the slender stack (k33), or ``S1 = S2 = 0``, the thin plate (kt).

    Raises
    ------
    UnusableInput
        `sides` is neither.

    Examples
    --------
    >>> from actuators.materials.poled_ceramic import transversely_isotropic
    >>> constants = {
    ...     "s11": 16.5e-12, "s12": -4.78e-12, "s13": -8.45e-12, "s33": 20.7e-12, "s44": 43.5e-12,
    ...     "d31": -274e-12, "d33": 593e-12, "d15": 741e-12, "eps11": 2.77e-8, "eps33": 3.01e-8,
    ... }
    >>> bar = uniaxial(transversely_isotropic(**constants))
    >>> round(float(bar.coupling_squared) ** 0.5, 2)  # k33
    0.75
    """
    if sides not in ("free", "clamped"):
        raise UnusableInput(f"uniaxial: sides = {sides!r}; give 'free' (bar) or 'clamped' (plate)")
    held: Form = "d" if sides == "free" else "e"
    m = material.to(held)
    picked = (a[2, 2] for a in (m.elastic, m.coupling, m.dielectric))
    values = picked if material.symbolic else map(float, picked)
    return Uniaxial(held, *values).to(form)
