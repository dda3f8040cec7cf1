"""A ceramic poled along axis 3 (class 6mm): its constants, coupling factors, and stacks of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, final

import numpy as np

from actuators.materials.constitutive import BadConstant, Piezoelectric
from bondgraph.support.errors import UnusableInput


def transversely_isotropic(
    *, s11: Any, s12: Any, s13: Any, s33: Any, s44: Any,
    d31: Any, d33: Any, d15: Any, eps11: Any, eps33: Any,
) -> Piezoelectric:  # fmt: skip
    """Return a ceramic poled along axis 3 in strain-charge form, ``s66 = 2 (s11 - s12)``.

    Parameters
    ----------
    s11, s12, s13, s33, s44 : number or expression
        Compliances at constant field, m^2/N.
    d31, d33, d15 : number or expression
        Charge constants, m/V; ``d31`` is negative.
    eps11, eps33 : number or expression
        Permittivities at constant stress, F/m.

    Raises
    ------
    BadConstant
        Names the constant that is not finite or has the wrong sign.

    Notes
    -----
    Stack actuator thesis, eq. 2.5.

    Examples
    --------
    >>> m = transversely_isotropic(s11=16.5e-12, s12=-4.78e-12, s13=-8.45e-12, s33=20.7e-12,
    ...     s44=43.5e-12, d31=-274e-12, d33=593e-12, d15=741e-12, eps11=27.7e-9, eps33=30.1e-9)
    >>> round(float(m.to("e").coupling[2, 2]), 2)
    23.24
    """
    s66 = 2 * (s11 - s12)
    elastic = [
        [s11, s12, s13, 0, 0, 0],
        [s12, s11, s13, 0, 0, 0],
        [s13, s13, s33, 0, 0, 0],
        [0, 0, 0, s44, 0, 0],
        [0, 0, 0, 0, s44, 0],
        [0, 0, 0, 0, 0, s66],
    ]
    coupling = [[0, 0, 0, 0, d15, 0], [0, 0, 0, d15, 0, 0], [d31, d31, d33, 0, 0, 0]]
    dielectric = [[eps11, 0, 0], [0, eps11, 0], [0, 0, eps33]]
    return Piezoelectric("d", np.array(elastic), np.array(coupling), np.array(dielectric))


@final
@dataclass(frozen=True, slots=True)
class CouplingFactors:
    """Coupling factors of a poled ceramic; ``k^2`` is converted over supplied energy (eq. 2.8).

    Attributes
    ----------
    k33 : longitudinal, a slender rod poled along its length
    k31 : transverse, a slender bar poled across
    k15 : shear of a plate
    kp : planar, radial motion of a thin disc
    kt : thickness, a wide plate whose sides cannot move
    """

    k33: Any
    k31: Any
    k15: Any
    kp: Any
    kt: Any


def coupling_factors(material: Piezoelectric) -> CouplingFactors:
    """Return the coupling factors of a material poled along axis 3, signed as d33, d31, d15, e33.

    Parameters
    ----------
    material : Piezoelectric
        In any form; its axes must be those of the poling (`kp` takes the plane 1-2 as isotropic).

    Raises
    ------
    BadConstant
        A factor reaches 1: such a material cannot exist.

    Notes
    -----
    IEEE Std 176: ``k33 = d33 / sqrt(s33^E eps33^T)``, ``k31 = d31 / sqrt(s11^E eps33^T)``,
    ``k15 = d15 / sqrt(s44^E eps11^T)``, ``kp = k31 sqrt(2 s11 / (s11 + s12))`` (stated positive),
    ``kt = e33 / sqrt(c33^D eps33^S)``.
    """
    d, root = material.to("d"), _root(material)
    s, k, eps = d.elastic, d.coupling, d.dielectric
    factors = {
        "k33": k[2, 2] / root(s[2, 2] * eps[2, 2]),
        "k31": k[2, 0] / root(s[0, 0] * eps[2, 2]),
        "k15": k[0, 4] / root(s[4, 4] * eps[0, 0]),
        "kp": root(2 * k[2, 0] ** 2 / ((s[0, 0] + s[0, 1]) * eps[2, 2])),
    }
    for name, value in factors.items():
        if not material.symbolic and not abs(value) < 1:
            raise BadConstant(
                f"{name} = {value:.4g}: a coupling factor lies below 1, for no material converts "
                "more energy than it gets; check the charge constants and their units"
            )
    e, h = material.to("e"), material.to("h")
    factors["kt"] = e.coupling[2, 2] / root(h.elastic[2, 2] * e.dielectric[2, 2])
    if material.symbolic:
        return CouplingFactors(**factors)
    return CouplingFactors(**{name: float(value) for name, value in factors.items()})


def _root(material: Piezoelectric) -> Any:
    if not material.symbolic:
        return np.sqrt
    import sympy as sp

    return sp.sqrt


@final
@dataclass(frozen=True, slots=True)
class StackConstants:
    """A stack as one degree of freedom: ``F = k x - T V``, ``q = T x + C V``.

    Parameters
    ----------
    stiffness : number or expression
        ``k`` at constant voltage (short circuit), N/m.
    capacitance : number or expression
        ``C`` of the clamped stack, F.
    transducer : number or expression
        ``T``, force from voltage (N/V) and charge from displacement (C/m).
    """

    stiffness: Any
    capacitance: Any
    transducer: Any

    def __post_init__(self) -> None:
        """Refuse what no stack can have."""
        for name in ("stiffness", "capacitance", "transducer"):
            value = getattr(self, name)
            if isinstance(value, int | float) and not 0 < value < float("inf"):
                raise UnusableInput(
                    f"stack: {name} = {value:g} is not positive and finite; for the capacitance "
                    "this happens when T^2/k exceeds the free capacitance (coupling above 1)"
                )

    @classmethod
    def from_free(cls, stiffness: Any, free_capacitance: Any, transducer: Any) -> StackConstants:
        """Return the constants from the free capacitance, which data sheets give."""
        return cls(stiffness, free_capacitance - transducer**2 / stiffness, transducer)

    @property
    def free_capacitance(self) -> Any:
        """Capacitance at zero force, ``C + T^2/k``, F."""
        return self.capacitance + self.transducer**2 / self.stiffness

    @property
    def open_stiffness(self) -> Any:
        """Stiffness at constant charge, ``k + T^2/C``, N/m."""
        return self.stiffness + self.transducer**2 / self.capacitance

    @property
    def displacement_per_volt(self) -> Any:
        """Free displacement ``T/k = n d33``, m/V."""
        return self.transducer / self.stiffness

    @property
    def coupling_squared(self) -> Any:
        """``k33^2 = 1 - C/C_free = 1 - k/k_open``."""
        return self.transducer**2 / (self.stiffness * self.free_capacitance)

    def as_lumped(self) -> dict[str, Any]:
        """Parameters of `stack_lumped`, usable as ``parameters=`` of `simulate`."""
        return {"C": self.capacitance, "T": self.transducer, "k": self.stiffness}

    def as_bond_graph(self, length: Any = 18e-3) -> dict[str, Any]:
        """Parameters of `stack_bond_graph`, whose C is free, k open and ``T = x/q`` in m/C.

        Parameters
        ----------
        length : number
            The gauge ``l`` of that model, m.
        """
        return {
            "C_nl": self.free_capacitance * length**2,
            "T": self.displacement_per_volt / self.free_capacitance,
            "k": self.open_stiffness,
        }


def stack_constants(
    material: Piezoelectric, layers: Any, area: Any, layer_thickness: Any
) -> StackConstants:
    """Return the constants of a slender stack of `layers` poled and driven along axis 3.

    Parameters
    ----------
    material : Piezoelectric
        In any form.
    layers : int or expression
        n, mechanically in series, electrically in parallel.
    area : number or expression
        A of a layer, m^2.
    layer_thickness : number or expression
        t between two electrodes, m.

    Raises
    ------
    UnusableInput
        A size is not positive.
    """
    d = material.to("d")
    s33, d33, eps33 = d.elastic[2, 2], d.coupling[2, 2], d.dielectric[2, 2]
    if not material.symbolic:
        s33, d33, eps33 = float(s33), float(d33), float(eps33)
    return longitudinal_stack(
        s33=s33, d33=d33, eps33=eps33, layers=layers, area=area, layer_thickness=layer_thickness
    )


def longitudinal_stack(
    *, s33: Any, d33: Any, eps33: Any, layers: Any, area: Any, layer_thickness: Any
) -> StackConstants:
    """Return the constants of a slender stack from the three constants that matter.

    Parameters
    ----------
    s33, d33, eps33 : number or expression
        Compliance at constant field (m^2/N), charge constant (m/V), permittivity at constant
        stress (F/m), as in the data sheet of a ceramic.
    layers, area, layer_thickness : number or expression
        As in `stack_constants`.

    Raises
    ------
    UnusableInput
        A value is not positive, or the constants would couple more than fully.

    Notes
    -----
    From eq. 2.1 of the stack actuator thesis with ``T1 = T2 = 0`` (sides free), inactive end
    plates and glue left out: ``k = A/(n t s33^E)``, ``T = k n d33``,
    ``C_free = n eps33^T A/t`` (eq. 3.3), ``C = C_free - T^2/k``.
    """
    given = {
        "s33": s33, "d33": d33, "eps33": eps33,
        "layers": layers, "area": area, "layer_thickness": layer_thickness,
    }  # fmt: skip
    for name, value in given.items():
        if isinstance(value, int | float) and not 0 < value < float("inf"):
            raise UnusableInput(
                f"stack: {name} = {value:g} is not positive and finite; give SI units"
            )
    k = area / (layers * layer_thickness * s33)
    free = layers * eps33 * area / layer_thickness
    return StackConstants.from_free(k, free, k * layers * d33)
