"""Physical domains: what effort, flow, displacement and momentum are called, and their SI units.

In every domain but the pseudo ones effort times flow is power, displacement is the integral of
flow and momentum the integral of effort.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from bondgraph.signals.units import Unit, parse_unit
from bondgraph.support.errors import unknown_name


@dataclass(frozen=True, slots=True)
class Quantity:
    """A power or energy variable of a domain.

    Parameters
    ----------
    name : str
        Such as `"voltage"`.
    symbol : str
        Usual letter, such as `"u"`.
    unit : str
        SI unit, as `parse_unit` reads it.
    """

    name: str
    symbol: str
    unit: str

    @property
    def parsed(self) -> Unit:
        """The unit with its scale and dimension."""
        return parse_unit(self.unit)


@dataclass(frozen=True, slots=True)
class Domain:
    """A physical domain.

    Parameters
    ----------
    name : str
        Its key in `DOMAINS`.
    effort, flow : Quantity
        The power variables.
    displacement, momentum : Quantity
        The energy variables: integral of flow, integral of effort.
    pseudo : bool
        True if effort times flow is not power.
    """

    name: str
    effort: Quantity
    flow: Quantity
    displacement: Quantity
    momentum: Quantity
    pseudo: bool = False


def _domain(name: str, *quantities: tuple[str, str, str], pseudo: bool = False) -> Domain:
    effort, flow, displacement, momentum = (Quantity(*q) for q in quantities)
    return Domain(name, effort, flow, displacement, momentum, pseudo)


_ALL = (
    _domain(
        "electrical",
        ("voltage", "u", "V"),
        ("current", "i", "A"),
        ("charge", "q", "C"),
        ("flux linkage", "psi", "V*s"),
    ),
    _domain(
        "translation",
        ("force", "F", "N"),
        ("velocity", "v", "m/s"),
        ("position", "x", "m"),
        ("momentum", "p", "N*s"),
    ),
    _domain(
        "rotation",
        ("torque", "M", "N*m"),
        ("angular velocity", "omega", "rad/s"),
        ("angle", "phi", "rad"),
        ("angular momentum", "L", "N*m*s"),
    ),
    _domain(
        "hydraulic",
        ("pressure", "p", "Pa"),
        ("volume flow", "Q", "m^3/s"),
        ("volume", "V", "m^3"),
        ("pressure momentum", "Gamma", "Pa*s"),
    ),
    _domain(
        "magnetic",
        ("magnetomotive force", "Theta", "A"),
        ("flux rate", "phi_dot", "V"),
        ("flux", "phi", "Wb"),
        ("magnetomotive impulse", "lambda", "A*s"),
    ),
    _domain(
        "thermal",
        ("temperature", "T", "K"),
        ("heat flow", "Q_dot", "W"),
        ("heat", "Q", "J"),
        ("temperature integral", "theta", "K*s"),
        pseudo=True,
    ),
    _domain(
        "polarisation",
        ("electric field", "E", "V/m"),
        ("dipole rate", "j", "A*m"),
        ("dipole moment", "d", "C*m"),
        ("field integral", "e_int", "V*s/m"),
    ),
    _domain(
        "generic",
        ("effort", "e", "1"),
        ("flow", "f", "1"),
        ("displacement", "q", "1"),
        ("momentum", "p", "1"),
        pseudo=True,
    ),
)

DOMAINS: Mapping[str, Domain] = MappingProxyType({d.name: d for d in _ALL})
"""All domains by name."""

_ALIASES = {
    "electric": "electrical",
    "mechanical": "translation",
    "mechanical translation": "translation",
    "mechanical rotation": "rotation",
    "fluid": "hydraulic",
    "polarization": "polarisation",
}


def domain(name: str) -> Domain:
    """Look a domain up by its name or a usual second name.

    Parameters
    ----------
    name : str
        Such as `"electrical"` or `"mechanical rotation"`; upper case and `_` or `-` for the space
        do not matter.

    Returns
    -------
    Domain
        The domain.

    Raises
    ------
    UnknownName
        If there is no such domain; the nearest names are given.

    Examples
    --------
    >>> domain("mechanical_rotation").effort.name
    'torque'
    """
    key = " ".join(str(name).lower().replace("_", " ").replace("-", " ").split())
    key = _ALIASES.get(key, key)
    if key not in DOMAINS:
        raise unknown_name("domain", name, "bondgraph.graph.domains", DOMAINS)
    return DOMAINS[key]
