"""Sizing of a stack and its amplifier (stack actuator thesis, sec. 3.2, eq. 3.1-3.4).

Every formula is a function of SI numbers; `sizing_sheet` puts them together for one stack, load
and drive. All are linear and small-signal: a stack at full voltage takes up to twice the charge.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from math import pi, sqrt
from typing import final

from bondgraph.support.errors import UnusableInput, require_positive

_check = partial(require_positive, "sizing")


def blocking_force(stiffness: float, free_displacement: float) -> float:
    """Return ``F_B = k dL``, N (eq. 3.1): the force at which the stack does not move.

    Examples
    --------
    >>> round(blocking_force(57e6, 15e-6), 6)
    855.0
    """
    _check(stiffness=stiffness, free_displacement=free_displacement)
    return stiffness * free_displacement


def ceramic_stiffness(area: float, length: float, compliance: float) -> float:
    """Return ``k = A/(s33 l)``, N/m: short circuit with s33^E, open circuit with s33^D."""
    _check(area=area, length=length, compliance=compliance)
    return area / (compliance * length)


def stack_mass(density: float, area: float, length: float) -> float:
    """Return ``rho A l``, kg."""
    _check(density=density, area=area, length=length)
    return density * area * length


def effective_mass(mass: float, load: float = 0.0) -> float:
    """Return ``m/3`` and the load at the tip, kg: the stack is held at its other end."""
    _check(or_zero=True, mass=mass, load=load)
    return mass / 3 + load


def resonance_frequency(stiffness: float, effective: float) -> float:
    """Return ``sqrt(k/m_eff)/(2 pi)``, Hz (eq. 3.2).

    ``m/3`` is right for a load that is heavy beside the stack; for the bare stack, a rod clamped
    at one end, it gives 10 % more than the exact ``sqrt(k/m)/4``.

    Examples
    --------
    >>> round(resonance_frequency(65e6, effective_mass(16e-3)))
    17570
    """
    _check(stiffness=stiffness, effective_mass=effective)
    return sqrt(stiffness / effective) / (2 * pi)


def stack_capacitance(
    layers: int, permittivity: float, area: float, layer_thickness: float
) -> float:
    """Return ``C = n eps33 A/t``, F (eq. 3.3), small-signal and free."""
    _check(layers=layers, permittivity=permittivity, area=area, layer_thickness=layer_thickness)
    return layers * permittivity * area / layer_thickness


def peak_current(frequency: float, capacitance: float, voltage_pp: float) -> float:
    """Return ``i = pi f C U_pp``, A (eq. 3.4): the peak for a sine.

    Examples
    --------
    >>> round(peak_current(100.0, 1.5e-6, 100.0), 4)
    0.0471
    """
    _check(frequency=frequency, capacitance=capacitance, voltage_pp=voltage_pp)
    return pi * frequency * capacitance * voltage_pp


def frequency_limit(current: float, capacitance: float, voltage_pp: float) -> float:
    """Return the frequency of a sine that takes the peak current (A), Hz; inverse of eq. 3.4."""
    _check(current=current, capacitance=capacitance, voltage_pp=voltage_pp)
    return current / (pi * capacitance * voltage_pp)


def slew_limit(current: float, capacitance: float) -> float:
    """Return ``i/C``, V/s: the fastest ramp that an amplifier of that current can drive."""
    _check(current=current, capacitance=capacitance)
    return current / capacitance


def sine_slew(frequency: float, voltage_pp: float) -> float:
    """Return ``pi f U_pp``, V/s: the steepest slope of a sine."""
    _check(frequency=frequency, voltage_pp=voltage_pp)
    return pi * frequency * voltage_pp


def current_per_frequency(capacitance: float, voltage_pp: float, displacement: float) -> float:
    """Return the dynamic operating current coefficient ``C U_pp/dx``, A/(Hz m) = uA/(Hz um).

    It gives the mean charging current ``f C U_pp``; the peak of a sine is pi times as much.
    """
    _check(capacitance=capacitance, voltage_pp=voltage_pp, displacement=displacement)
    return capacitance * voltage_pp / displacement


def electrical_energy(capacitance: float, voltage: float) -> float:
    """Return ``C U^2/2``, J: what the stack holds at that voltage."""
    _check(capacitance=capacitance, voltage=voltage)
    return 0.5 * capacitance * voltage**2


def generated_voltage(force: float, displacement_per_volt: float, capacitance: float) -> float:
    """Return ``(x/U) F/C``, V: what a force does to a stack with open leads.

    The charge of a force is ``n d33 F``, and ``n d33`` is the free displacement per volt; its
    energy is `electrical_energy` at this voltage.
    """
    _check(force=force, displacement_per_volt=displacement_per_volt, capacitance=capacitance)
    return displacement_per_volt * force / capacitance


def peak_power(
    frequency: float, capacitance: float, voltage_pp: float, supply: float | None = None
) -> float:
    """Return ``pi f C U_pp U_supply``, W: the peak an amplifier takes from its supply.

    Parameters
    ----------
    supply : float, optional
        V; at least the output. Left out: `voltage_pp`.
    """
    supply = voltage_pp if supply is None else supply
    _check(supply=supply)
    return peak_current(frequency, capacitance, voltage_pp) * supply


def dissipated_power(
    frequency: float, capacitance: float, voltage_pp: float, tan_delta: float
) -> float:
    """Return ``pi f C tan(delta) U_pp^2/4``, W: the dielectric heat of a sine in the stack."""
    _check(or_zero=True, tan_delta=tan_delta)
    return peak_current(frequency, capacitance, voltage_pp) * voltage_pp * tan_delta / 4


@final
@dataclass(frozen=True, slots=True)
class OperatingPoint:
    """Where the line of the stack meets its load (stack actuator thesis, fig. 3.3).

    Attributes
    ----------
    displacement : float
        From the position at zero volts under the same load, m.
    force : float
        Of the stack on its load at that point, N.
    work : float
        Into the load during the stroke, J.
    """

    displacement: float
    force: float
    work: float


def operating_point(
    stiffness: float,
    free_displacement: float,
    load_stiffness: float = 0.0,
    load_force: float = 0.0,
) -> OperatingPoint:
    """Return the point at which a stack moves a spring and a constant force (a weight).

    ``x = dL k/(k + k_load)``: a spring shortens the stroke, a weight only shifts it. The work into
    a spring is largest, a quarter of ``k dL^2/2``, for ``k_load = k``.

    Parameters
    ----------
    stiffness, free_displacement : float
        Of the stack, N/m and m at the voltage in question.
    load_stiffness : float
        N/m; relaxed at zero volts.
    load_force : float
        N, pressing against the stack.

    Raises
    ------
    UnusableInput
        A value is out of its domain, or the force exceeds the blocking force.

    Examples
    --------
    >>> operating_point(60e6, 15e-6, 60e6).displacement
    7.5e-06
    """
    _check(or_zero=True, load_stiffness=load_stiffness, load_force=load_force)
    blocked = blocking_force(stiffness, free_displacement)
    if load_force > blocked:
        raise UnusableInput(
            f"sizing: the load presses with {load_force:g} N, the stack is blocked at "
            f"{blocked:g} N; take a thicker stack or a smaller load"
        )
    x = free_displacement * stiffness / (stiffness + load_stiffness)
    return OperatingPoint(
        x, load_force + load_stiffness * x, load_force * x + 0.5 * load_stiffness * x * x
    )


@final
@dataclass(frozen=True, slots=True)
class StackData:
    """What a data sheet says of a stack; SI.

    Parameters
    ----------
    name : str
    free_displacement : float
        m, at `voltage`.
    voltage : float
        Largest voltage, V; the drive runs from 0.
    stiffness : float
        N/m.
    capacitance : float
        Small-signal, free, F.
    mass : float
        Of the ceramics, kg.
    push_force, pull_force : float or None
        Largest permitted, N.
    tan_delta : float or None
        Dielectric loss.
    """

    name: str
    free_displacement: float
    voltage: float
    stiffness: float
    capacitance: float
    mass: float
    push_force: float | None = None
    pull_force: float | None = None
    tan_delta: float | None = None

    def __post_init__(self) -> None:
        """Refuse values out of their domain."""
        _check(free_displacement=self.free_displacement, voltage=self.voltage,
            stiffness=self.stiffness, capacitance=self.capacitance, mass=self.mass,
        )  # fmt: skip
        given = {n: getattr(self, n) for n in ("push_force", "pull_force", "tan_delta")}
        _check(or_zero=True, **{n: v for n, v in given.items() if v is not None})


P_840_1 = StackData(
    "P-840.1", 15e-6, 100.0, 57e6, 1.5e-6, 16e-3, push_force=1000.0, pull_force=50.0
)
"""The stack of the thesis: table 3.1; the mass of table 6.1 is the author's estimate."""

STACKS: Mapping[str, StackData] = {P_840_1.name: P_840_1}
