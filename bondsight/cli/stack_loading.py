"""Erasing the memory of a stack and the slopes of its loading curve, on simulated stacks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from actuators import stack_lumped
from actuators.stack.excitation import (
    demagnetisation,
    loading_ramp,
    printed_demagnetisation,
    residual_bound,
)
from actuators.stack.loading_curve import LoadingCurve, Slope, loading_slopes, transducer_constant
from bondgraph import simulate
from bondgraph.hysteresis import AlJanaideh, Ang, MaxwellResistiveCapacitor
from bondgraph.laws import Hysteretic
from bondsight.cli.stack_figures import loading_figure

__all__ = ["mechanical"]

FloatArray = NDArray[np.float64]
STIFFNESS = 65e6
NOISE = 2e-9
ALJ, ANG = AlJanaideh.stack_2hz(), Ang.stack_2hz()
OPERATORS: dict[str, AlJanaideh | Ang] = {"eq. (6.2), Al Janaideh": ALJ, "eq. (6.3), Ang": ANG}


def mechanical(figure: Path | None = None) -> int:
    """Erase the memory, load, take slopes (sections 6.1 and 6.2 of the stack actuator thesis)."""
    _erasing()
    curves = _loading()
    _known_transducer()
    if figure is not None:
        loading_figure(curves, figure)
    return 0


def _histories(thresholds: tuple[float, ...]) -> dict[str, FloatArray]:
    """Return the voltages before the loading; all end at 0 V."""
    loop = np.array([0.0, 100.0, 0.0])
    around_zero = demagnetisation(thresholds, 0.0, partial=True).volt
    around_fifty = demagnetisation(thresholds, 50.0).volt
    return {
        "never driven": np.zeros(1),
        "after 0..100..0 V": loop,
        "then eq. (6.1)": np.concatenate((loop, printed_demagnetisation().volt, [0.0])),
        "then decay 20 V around 0": np.concatenate((loop, around_zero)),
        "then decay around 50, down to 0": np.concatenate((loop, around_fifty, [0.0])),
    }


def _thresholds(operator: AlJanaideh | Ang) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Thresholds (V) and weights of the plays that have a weight."""
    plays = operator.as_prandtl_ishlinskii() if isinstance(operator, AlJanaideh) else operator.play
    pairs = [
        (float(r), float(w)) for r, w in zip(plays.thresholds, plays.weights, strict=True) if w != 0
    ]
    return tuple(r for r, _ in pairs), tuple(w for _, w in pairs)


def _erasing() -> None:
    print("Remanence at 0 V (nm); voltage limits -20 .. 120 V")
    for name, operator in OPERATORS.items():
        thresholds, _ = _thresholds(operator)
        print(f"  {name}: widest play {thresholds[-1]:.1f} V")
        for history, signal in _histories(thresholds).items():
            left = 1e9 * float(operator.run(signal)[0][-1])
            since = signal[3:] if signal.size > 3 else signal
            print(f"    {history:34s}{left:8.1f}   by {since.min():6.1f} .. {since.max():5.1f} V")
    r, w = _thresholds(ALJ)
    best = 1e9 * sum(w_i * max(r_i - 20.0, 0.0) for r_i, w_i in zip(r, w, strict=True))
    print(f"  least that -20 V can leave after 100 V, sum w max(r - 20 V, 0): {best:.1f} nm")
    print("Erased around 50 V (eq. (6.2)): distance from the plays at rest at 50 V (nm)")
    plays = ALJ.as_prandtl_ishlinskii()
    rest = float(np.asarray(plays.run([50.0], memory=(50.0,) * plays.n_memory)[0])[0])
    spacing = float(np.diff(r).min())
    for part in (0.5, 0.1, 0.02):
        step = part * spacing
        erasing = demagnetisation(r, 50.0, step=step)
        left = max(
            abs(float(plays.run(np.concatenate((before, erasing.volt)))[0][-1]) - rest)
            for before in ([0.0], [0.0, 100.0, 0.0], [0.0, 120.0, -20.0, 0.0])
        )
        # the decay begins half a step above the widest play
        bound = residual_bound(r, w, float(r[-1]) + 0.5 * step, step)
        print(
            f"  step {step:6.3f} V, {erasing.time[-1]:6.1f} s: {1e9 * left:7.3f}, "
            f"bound {1e9 * bound:7.3f}"
        )


def _loading() -> dict[str, LoadingCurve]:
    """Print the slopes of both operators; return the loading curves of eq. (6.2) by history."""
    kept: dict[str, LoadingCurve] = {}
    print(
        f"Loading in 10 s at 3125 Hz, {1e9 * NOISE:g} nm noise; slopes in nm/V, T = k slope, "
        f"k = {STIFFNESS / 1e6:g} N/um"
    )
    print(
        f"  {'':34s}{'first 2 V':>10s}{'last of 50 [95 %]':>24s}{'chord +-':>14s}{'T N/V':>8s}"
        f"{'off curve nm':>14s}"
    )
    for top in (100.0, 60.0):
        for name, operator in OPERATORS.items():
            print(f"  {name}, 0..{top:g} V")
            fresh = np.zeros(0)
            for i, (history, before) in enumerate(_histories(_thresholds(operator)[0]).items()):
                ramp = loading_ramp(0.0, top)
                clean = operator.run(np.concatenate((before, ramp.volt)))[0][-ramp.volt.size :]
                noise = NOISE * np.random.default_rng(i).standard_normal(clean.size)
                curve = LoadingCurve(ramp.volt, clean + noise)
                fresh = clean if i == 0 else fresh
                off = float(np.abs((clean - clean[0]) - (fresh - fresh[0])).max())
                found = loading_slopes(curve)
                t = transducer_constant(found.last, STIFFNESS)
                print(
                    f"    {history:32s}{1e9 * found.first.value:10.2f}{_interval(found.last):>24s}"
                    f"{1e9 * found.chord.value:8.2f} {1.96e9 * found.chord.standard_error:5.2f}"
                    f"{t.value:8.3f}{1e9 * off:14.1f}"
                )
                if operator is ALJ and top == 100.0:
                    kept[history] = LoadingCurve(ramp.volt, clean)
    return kept


def _interval(slope: Slope) -> str:
    low, high = slope.ci95
    return f"{1e9 * slope.value:.3f} [{1e9 * low:.3f}, {1e9 * high:.3f}]"


def _known_transducer() -> None:
    """Apply the method to a stack whose T is known."""
    ramp = loading_ramp(0.0, 100.0, 10.0, 500.0)
    graph = stack_lumped(Hysteretic(MaxwellResistiveCapacitor.stack_2hz()))
    run = simulate(graph, ramp.time, {"V_in": ramp.volt}, observed=("e_clamp",))
    found = loading_slopes(ramp.volt, run["x"])
    t = transducer_constant(found.last, STIFFNESS)
    inside = ramp.volt >= found.last.window[0]
    share = float(np.polyfit(ramp.volt[inside], run["e_clamp"][inside], 1)[0])
    true = graph.parameters["T"].value
    print(
        f"Lumped stack with the Maxwell elements, T = {true:g} N/V: k slope = {t.value:.3f} N/V "
        f"({100 * (t.value / true - 1):+.1f} %), as dV_t/dV = {share:.4f} in the last segment"
    )
