"""Linear piezoelectricity in its four forms (IEEE Std 176; stack actuator thesis, eq. 2.1-2.7).

| form | independent | elastic | coupling | dielectric |
| --- | --- | --- | --- | --- |
| ``d`` strain-charge ``S = s^E T + d^T E``, ``D = d T + eps^T E`` | T, E | s^E | d | eps^T |
| ``e`` stress-charge ``T = c^E S - e^T E``, ``D = e S + eps^S E`` | S, E | c^E | e | eps^S |
| ``g`` strain-voltage ``S = s^D T + g^T D``, ``E = -g T + beta^T D`` | T, D | s^D | g | beta^T |
| ``h`` stress-voltage ``T = c^D S - h^T D``, ``E = -h S + beta^S D`` | S, D | c^D | h | beta^S |

Two exchanges lead everywhere: strain with stress (d <-> e, g <-> h) and charge with field
(d <-> g, e <-> h). Numbers and SymPy expressions are treated alike.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias, final

import numpy as np
from numpy.typing import ArrayLike

from actuators.materials.voigt import (
    Array,
    check_rotation,
    entries,
    is_symbolic,
    strain_rotation,
    stress_rotation,
)
from bondgraph.support.errors import BondsightError, UnusableInput, require_known

Form: TypeAlias = Literal["d", "e", "g", "h"]

FORMS: dict[str, tuple[str, str, str]] = {
    "d": ("s^E", "d", "eps^T"),
    "e": ("c^E", "e", "eps^S"),
    "g": ("s^D", "g", "beta^T"),
    "h": ("c^D", "h", "beta^S"),
}
"""Names of the elastic, coupling and dielectric constants of each form."""

MECHANICAL: dict[str, tuple[Form, int]] = {
    "d": ("e", -1), "e": ("d", 1), "g": ("h", 1), "h": ("g", -1),
}  # fmt: skip
"""Partner form, and the sign of ``K A^-1 K^T`` in the constant that the exchange leaves."""
ELECTRICAL: dict[str, tuple[Form, int]] = {
    "d": ("g", -1), "g": ("d", 1), "e": ("h", 1), "h": ("e", -1),
}  # fmt: skip
_SYMMETRY = 1e-9


class BadConstant(BondsightError, ValueError):
    """A constant of a material has the wrong shape, sign or symmetry."""


@final
@dataclass(frozen=True, eq=False)
class Piezoelectric:
    """The constants of a linear piezoelectric material in one of the four forms.

    Parameters
    ----------
    form : {"d", "e", "g", "h"}
    elastic : array, shape (6, 6)
        Compliance (m^2/N) in forms d and g, stiffness (N/m^2) in e and h.
    coupling : array, shape (3, 6)
        d (m/V), e (C/m^2), g (V m/N) or h (V/m).
    dielectric : array, shape (3, 3)
        Permittivity (F/m) in forms d and e, its inverse (m/F) in g and h.

    Raises
    ------
    BadConstant
        Names the entry that is missing, not finite, not symmetric or not positive. Expressions
        can only be checked for their shape.

    Examples
    --------
    >>> cube = Piezoelectric("d", 2e-11 * np.eye(6), np.zeros((3, 6)), 1e-8 * np.eye(3))
    >>> float(cube.to("e").elastic[0, 0]), cube.to("g").names
    (50000000000.0, ('s^D', 'g', 'beta^T'))
    """

    form: Form
    elastic: Array
    coupling: Array
    dielectric: Array

    def __post_init__(self) -> None:
        """Check the constants and make the arrays read-only."""
        require_known("form", "the constitutive equations", FORMS, self.form)
        a, k, b = self.names
        elastic = _square(a, self.elastic, 6)
        coupling = _sized(k, self.coupling, (3, 6))
        dielectric = _square(b, self.dielectric, 3)
        kind = object if any(map(is_symbolic, (elastic, coupling, dielectric))) else np.float64
        for field, array in zip(
            ("elastic", "coupling", "dielectric"), (elastic, coupling, dielectric), strict=True
        ):
            array = array.astype(kind)
            array.setflags(write=False)
            object.__setattr__(self, field, array)

    @property
    def names(self) -> tuple[str, str, str]:
        """Names of the elastic, coupling and dielectric constants."""
        return FORMS[self.form]

    @property
    def symbolic(self) -> bool:
        """Whether the constants are expressions."""
        return is_symbolic(self.elastic)

    def to(self, form: Form) -> Piezoelectric:
        """Return the same material in another form.

        Raises
        ------
        BadConstant
            An inverse that the other form needs does not exist.
        """
        mechanical, electrical = exchanges(self.form, form)
        same = _exchange_mechanical(self) if mechanical else self
        return _exchange_electrical(same) if electrical else same

    def rotated(self, rotation: ArrayLike) -> Piezoelectric:
        """Return the constants in other axes.

        Parameters
        ----------
        rotation : array, shape (3, 3)
            Unit vectors of the new axes as rows.
        """
        r = check_rotation(rotation)
        # d and g multiply a stress, e and h a strain
        k = strain_rotation(r) if self.form in "dg" else stress_rotation(r)
        return Piezoelectric(
            self.form,
            _tidy(_even(k @ self.elastic @ k.T)),
            _tidy(r @ self.coupling @ k.T),
            _tidy(_even(r @ self.dielectric @ r.T)),
        )

    def energy_matrix(self) -> Array:
        """Return ``W``, shape (9, 9): the energy density is ``[T; E]^T W [T; E] / 2``, J/m^3."""
        d = self.to("d")
        return np.block([[d.elastic, d.coupling.T], [d.coupling, d.dielectric]])

    def check_stable(self) -> None:
        """Raise if some stress and field would store negative energy.

        The matrix is scaled to a diagonal of one first: compliances and permittivities differ by
        three powers of ten, coupling factors do not.

        Raises
        ------
        BadConstant
            Names the stresses and fields that take part, and the smallest eigenvalue. Expressions
            cannot be judged.
        """
        if self.symbolic:
            raise BadConstant("the constants are expressions; put in numbers to judge stability")
        w = self.energy_matrix()
        diagonal = np.diag(w)
        if (diagonal <= 0).any():
            i = int(np.argmin(diagonal))
            raise BadConstant(
                f"the material is not stable: {_LOADS[i]} alone stores {diagonal[i]:.3g}/2 < 0; "
                f"check {_names_of(i)}"
            )
        scale = 1 / np.sqrt(diagonal)
        values, vectors = np.linalg.eigh(w * np.outer(scale, scale))
        if values[0] <= 1e-12:
            parts = [
                _LOADS[i] for i in np.argsort(-np.abs(vectors[:, 0])) if abs(vectors[i, 0]) > 0.2
            ]
            raise BadConstant(
                f"the material is not stable: {', '.join(parts)} together store negative energy "
                f"(smallest scaled eigenvalue {values[0]:.3g}); the constants that join them are "
                "too large, check their signs and units"
            )


def exchanges(held: Form, wanted: Form) -> tuple[bool, bool]:
    """Return whether strain with stress, and charge with field, have to be exchanged."""
    require_known("form", "the constitutive equations", FORMS, wanted)
    return (wanted in "eh") != (held in "eh"), (wanted in "gh") != (held in "gh")


_LOADS = ("T1", "T2", "T3", "T4", "T5", "T6", "E1", "E2", "E3")


def _names_of(i: int) -> str:
    return f"s^E_{i + 1}{i + 1}" if i < 6 else f"eps^T_{i - 5}{i - 5}"


def _sized(name: str, values: ArrayLike, shape: tuple[int, int]) -> Array:
    try:
        array = entries(name, values, shape)
    except UnusableInput as error:
        raise BadConstant(str(error)) from None
    if array.shape != shape:
        raise BadConstant(f"{name} has shape {array.shape}; it must be {shape}")
    return array


def _square(name: str, values: ArrayLike, n: int) -> Array:
    array = _sized(name, values, (n, n))
    if is_symbolic(array):
        return array
    size = np.sqrt(np.abs(np.outer(np.diag(array), np.diag(array))))
    skew = np.abs(array - array.T) > _SYMMETRY * np.maximum(size, np.abs(array))
    if skew.any():
        i, j = (int(v) for v in np.argwhere(skew)[0])
        raise BadConstant(
            f"{name} is not symmetric: {name}_{i + 1}{j + 1} = {array[i, j]:.6g} but "
            f"{name}_{j + 1}{i + 1} = {array[j, i]:.6g}; energy needs both equal"
        )
    if (np.diag(array) <= 0).any():
        i = int(np.argwhere(np.diag(array) <= 0)[0, 0])
        raise BadConstant(
            f"{name}_{i + 1}{i + 1} = {array[i, i]:.6g} is not positive; a load in that direction "
            "would return energy, check its sign and unit"
        )
    return _even(array)


def _even(array: Array) -> Array:
    """Remove the rounding that makes a symmetric result slightly uneven."""
    return array if is_symbolic(array) else (array + array.T) / 2


def _tidy(array: Array) -> Array:
    if not is_symbolic(array):
        return array
    import sympy as sp

    tidy: Array = np.vectorize(lambda v: sp.factor(v), otypes=[object])(array)
    return tidy


def _inverse(name: str, array: Array) -> Array:
    if is_symbolic(array):
        return _symbolic_inverse(name, array)
    try:
        inverse = np.linalg.inv(array)
    except np.linalg.LinAlgError:
        raise _singular(name) from None
    return _even(inverse)


def _singular(name: str) -> BadConstant:
    return BadConstant(f"{name} is singular, so the other form does not exist; check its entries")


def _symbolic_inverse(name: str, array: Array) -> Array:
    """Invert block by block in the field of fractions; symbolic elimination would not end."""
    import sympy as sp
    from sympy.polys.matrices import DomainMatrix
    from sympy.polys.matrices.exceptions import DMNonInvertibleMatrixError

    matrix = sp.Matrix(array.tolist())
    inverse = sp.zeros(*matrix.shape)
    for block in matrix.connected_components():
        try:
            part = DomainMatrix.from_Matrix(matrix.extract(block, block)).to_field().inv()
        except DMNonInvertibleMatrixError:
            raise _singular(name) from None
        found = part.to_Matrix()
        for i, row in enumerate(block):
            for j, column in enumerate(block):
                inverse[row, column] = sp.factor(found[i, j])
    return np.array(inverse.tolist(), dtype=object)


def _exchange_mechanical(m: Piezoelectric) -> Piezoelectric:
    form, sign = MECHANICAL[m.form]
    inverse = _inverse(m.names[0], m.elastic)
    coupling = m.coupling @ inverse
    dielectric = m.dielectric + sign * _even(coupling @ m.coupling.T)
    return Piezoelectric(form, inverse, _tidy(coupling), _tidy(dielectric))


def _exchange_electrical(m: Piezoelectric) -> Piezoelectric:
    form, sign = ELECTRICAL[m.form]
    inverse = _inverse(m.names[2], m.dielectric)
    coupling = inverse @ m.coupling
    elastic = m.elastic + sign * _even(m.coupling.T @ coupling)
    return Piezoelectric(form, _tidy(elastic), _tidy(coupling), inverse)
