"""A sizing sheet: stack, load and amplifier in one table, for the terminal and for notebooks."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from math import pi
from typing import final

from actuators.stack.sizing import (
    StackData,
    blocking_force,
    current_per_frequency,
    dissipated_power,
    effective_mass,
    electrical_energy,
    frequency_limit,
    generated_voltage,
    operating_point,
    peak_current,
    peak_power,
    resonance_frequency,
    sine_slew,
    slew_limit,
)
from bondgraph.signals.quantity import engineering
from bondgraph.support.errors import UnusableInput, unknown_name


@final
@dataclass(frozen=True, slots=True)
class SizingRow:
    """One line: what, its value in SI (None where the data are missing), unit, formula."""

    section: str
    name: str
    value: float | None
    unit: str
    formula: str = ""

    @property
    def text(self) -> str:
        """Value and unit."""
        return "not given" if self.value is None else engineering(self.value, self.unit, 4)


@final
@dataclass(frozen=True, slots=True)
class SizingSheet:
    """Rows in order, and what the user has to be warned of; ``sheet["resonance"]`` is a number.

    Examples
    --------
    >>> from actuators.stack.sizing import P_840_1
    >>> sheet = sizing_sheet(P_840_1, load_mass=0.5)
    >>> sheet.rows[0].text, sheet.warnings
    ('15 um', ())
    """

    title: str
    rows: tuple[SizingRow, ...]
    warnings: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> float | None:
        """Value of a row in SI."""
        for row in self.rows:
            if row.name == name:
                return row.value
        raise unknown_name("row", name, self.title, (r.name for r in self.rows))

    def __str__(self) -> str:
        """Return the sheet as text."""
        names = max(len(r.name) for r in self.rows)
        values = max(len(r.text) for r in self.rows)
        lines, section = [self.title], ""
        for r in self.rows:
            if r.section != section:
                section = r.section
                lines += ["", section]
            lines.append(f"  {r.name:<{names}}  {r.text:>{values}}  {r.formula}".rstrip())
        if self.warnings:
            lines.append("")
        return "\n".join([*lines, *(f"warning: {w}" for w in self.warnings)])

    def _repr_html_(self) -> str:
        """Return the sheet as a table for notebooks."""
        body, section = [], ""
        for r in self.rows:
            if r.section != section:
                section = r.section
                body.append(f'<tr><th colspan="3">{escape(section)}</th></tr>')
            body.append(
                f"<tr><td>{escape(r.name)}</td><td>{escape(r.text)}</td>"
                f"<td><code>{escape(r.formula)}</code></td></tr>"
            )
        warned = "".join(f"<p><strong>warning:</strong> {escape(w)}</p>" for w in self.warnings)
        return f"<table><caption>{escape(self.title)}</caption>{''.join(body)}</table>{warned}"


def sizing_sheet(
    stack: StackData,
    *,
    frequency: float = 100.0,
    voltage_pp: float | None = None,
    current: float = 0.2,
    load_mass: float = 0.0,
    load_stiffness: float = 0.0,
    load_force: float = 0.0,
) -> SizingSheet:
    """Return the sheet of a stack that moves a load by a sine from 0 to `voltage_pp`.

    Parameters
    ----------
    stack : StackData
    frequency : float
        Of the drive, Hz.
    voltage_pp : float, optional
        V; left out: the largest voltage of the stack.
    current : float
        Peak current of the amplifier, A.
    load_mass, load_stiffness, load_force : float
        At the tip: kg, N/m, N (pressing on the stack).

    Raises
    ------
    UnusableInput
        A value is out of its domain, the voltage exceeds that of the stack, or the load force
        its blocking force.

    Examples
    --------
    >>> from actuators.stack.sizing import P_840_1
    >>> sheet = sizing_sheet(P_840_1, frequency=200.0, load_mass=0.05)
    >>> [r.name for r in sheet.rows][:4]
    ['free displacement', 'stiffness', 'blocking force', 'permitted push']
    """
    volts = stack.voltage if voltage_pp is None else voltage_pp
    if volts > stack.voltage:
        raise UnusableInput(
            f"sizing: {volts:g} V exceed the {stack.voltage:g} V of {stack.name}; lower the drive"
        )
    stroke = stack.free_displacement * volts / stack.voltage
    point = operating_point(stack.stiffness, stroke, load_stiffness, load_force)
    mass = effective_mass(stack.mass, load_mass)
    resonance = resonance_frequency(stack.stiffness + load_stiffness, mass)
    inertia = mass * (2 * pi * frequency) ** 2 * point.displacement / 2
    needed = peak_current(frequency, stack.capacitance, volts)
    rows = (
        *_stack_rows(stack, stroke),
        SizingRow("load", "displacement", point.displacement, "m", "dL k/(k + k_load)"),
        SizingRow("load", "force", point.force, "N", "F_load + k_load x"),
        SizingRow("load", "work a stroke", point.work, "J", "F_load x + k_load x^2/2"),
        SizingRow("load", "effective mass", mass, "kg", "m/3 + m_load"),
        SizingRow("load", "inertia force", inertia, "N", "m_eff (2 pi f)^2 x/2"),
        SizingRow("load", "resonance", resonance, "Hz", "sqrt((k + k_load)/m_eff)/(2 pi)"),
        *_amplifier_rows(stack, frequency, volts, stroke, current),
        *_generator_rows(stack),
    )
    title = (
        f"{stack.name}: {engineering(volts, 'V', 4)} peak to peak at "
        f"{engineering(frequency, 'Hz', 4)}, amplifier {engineering(current, 'A', 4)}"
    )
    # at the low end of the stroke the moved mass presses with the load, at the high end it pulls
    # against it; the voltage may also rest there
    push, pull = max(point.force, load_force + inertia), inertia - point.force
    warnings = _warnings(stack, frequency, resonance, needed, current, push, pull)
    return SizingSheet(title, rows, warnings)


def _stack_rows(stack: StackData, stroke: float) -> list[SizingRow]:
    blocked = blocking_force(stack.stiffness, stroke)
    return [
        SizingRow("stack", "free displacement", stroke, "m", "linear in the voltage"),
        SizingRow("stack", "stiffness", stack.stiffness, "N/m"),
        SizingRow("stack", "blocking force", blocked, "N", "k dL"),
        SizingRow("stack", "permitted push", stack.push_force, "N"),
        SizingRow("stack", "permitted pull", stack.pull_force, "N"),
    ]


def _amplifier_rows(
    stack: StackData, frequency: float, volts: float, stroke: float, current: float
) -> list[SizingRow]:
    c = stack.capacitance
    loss = stack.tan_delta
    heat = None if loss is None else dissipated_power(frequency, c, volts, loss)
    power = peak_power(frequency, c, volts, stack.voltage)
    coefficient = current_per_frequency(c, volts, stroke)
    table = [
        ("capacitance", c, "F", "n eps33 A/t, small-signal"),
        ("peak current", peak_current(frequency, c, volts), "A", "pi f C U_pp"),
        ("mean current", frequency * c * volts, "A", "f C U_pp"),
        ("frequency limit", frequency_limit(current, c, volts), "Hz", "i/(pi C U_pp)"),
        ("slew needed", sine_slew(frequency, volts), "V/s", "pi f U_pp"),
        ("slew limit", slew_limit(current, c), "V/s", "i/C"),
        ("current coefficient", coefficient, "A/(Hz*m)", "C U_pp/dL; also in uA/(Hz*um)"),
        ("stored energy", electrical_energy(c, volts), "J", "C U_pp^2/2"),
        ("peak power", power, "W", "pi f C U_pp U_max"),
        ("heat in the stack", heat, "W", "pi f C tan(delta) U_pp^2/4"),
    ]
    return [SizingRow("amplifier", *line) for line in table]


def _generator_rows(stack: StackData) -> list[SizingRow]:
    if not stack.push_force:
        return []
    per_volt = stack.free_displacement / stack.voltage
    volts = generated_voltage(stack.push_force, per_volt, stack.capacitance)
    section = "generator, at the permitted push"
    return [
        SizingRow(section, "voltage", volts, "V", "(dL/U) F/C, open"),
        SizingRow(section, "energy", electrical_energy(stack.capacitance, volts), "J", "C U^2/2"),
    ]


def _warnings(
    stack: StackData,
    frequency: float,
    resonance: float,
    needed: float,
    current: float,
    push: float,
    pull: float,
) -> tuple[str, ...]:
    found = []
    if needed > current:
        found.append(
            f"the drive needs {engineering(needed, 'A', 4)}, the amplifier gives "
            f"{engineering(current, 'A', 4)}; lower the frequency or the voltage"
        )
    if 2 * frequency > resonance:
        found.append(
            f"the resonance {engineering(resonance, 'Hz', 4)} is below twice the drive frequency; "
            "lighten the load or take a stiffer stack"
        )
    if stack.push_force is not None and push > stack.push_force:
        found.append(
            f"load and moved mass press with up to {engineering(push, 'N', 4)}, permitted are "
            f"{engineering(stack.push_force, 'N', 4)}; lower the load or go slower"
        )
    if stack.pull_force is not None and pull > stack.pull_force:
        found.append(
            f"the moved mass pulls with {engineering(pull, 'N', 4)} more than the load presses, "
            f"permitted are {engineering(stack.pull_force, 'N', 4)}; preload the stack or go slower"
        )
    return tuple(found)
