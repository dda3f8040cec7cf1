"""Erasing the memory of a stack and the slopes of its loading curve, on simulated stacks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from actuators.stack.excitation import (
    demagnetisation,
    loading_ramp,
    printed_demagnetisation,
    residual_bound,
)
from actuators.stack.loading_curve import (
    LoadingCurve,
    LoadingSlopes,
    Slope,
    loading_slopes,
    transducer_constant,
)
from actuators.stack.lumped import stack_lumped
from bondgraph.hysteresis import AlJanaideh, Ang, MaxwellResistiveCapacitor
from bondgraph.laws import Hysteretic
from bondgraph.simulation.simulate import simulate
from bondgraph.support.ops import FloatArray

STIFFNESS = 65e6
NOISE = 2e-9
ALJ, ANG = AlJanaideh.stack_2hz(), Ang.stack_2hz()
OPERATORS: dict[str, AlJanaideh | Ang] = {"eq. (6.2), Al Janaideh": ALJ, "eq. (6.3), Ang": ANG}


@dataclass(frozen=True, slots=True)
class Remanence:
    """Displacement (m) that a history leaves at 0 V, and the voltages (V) of its erasing."""

    operator: str
    widest: float
    history: str
    left: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class DecayRest:
    """Step (V) and duration (s) of a decay, what it leaves at most and its bound (m)."""

    step: float
    seconds: float
    left: float
    bound: float


@dataclass(frozen=True, slots=True)
class ErasingStudy:
    """What erasing leaves; `least` is what no erasing down to -20 V can go below (m)."""

    remanences: tuple[Remanence, ...]
    least: float
    decays: tuple[DecayRest, ...]

    def __str__(self) -> str:
        """Return the tables."""
        lines = ["Remanence at 0 V (nm); voltage limits -20 .. 120 V"]
        for r in self.remanences:
            head = f"  {r.operator}: widest play {r.widest:.1f} V"
            lines += [] if head in lines else [head]
            left = f"    {r.history:34s}{1e9 * r.left:8.1f}"
            lines.append(f"{left}   by {r.low:6.1f} .. {r.high:5.1f} V")
        lines += [
            "  least that -20 V can leave after 100 V, sum w max(r - 20 V, 0): "
            f"{1e9 * self.least:.1f} nm",
            "Erased around 50 V (eq. (6.2)): distance from the plays at rest at 50 V (nm)",
        ]
        lines += [
            f"  step {d.step:6.3f} V, {d.seconds:6.1f} s: {1e9 * d.left:7.3f}, "
            f"bound {1e9 * d.bound:7.3f}"
            for d in self.decays
        ]
        return "\n".join(lines)


@dataclass(frozen=True, slots=True)
class LoadingRow:
    """Slopes after a history, up to `top` (V); `off` is the distance from a virgin stack (m)."""

    top: float
    operator: str
    history: str
    slopes: LoadingSlopes
    off: float


@dataclass(frozen=True, slots=True)
class LoadingStudy:
    """Slopes of both operators; curves of eq. (6.2) without noise, by history."""

    rows: tuple[LoadingRow, ...]
    curves: Mapping[str, LoadingCurve]

    def __str__(self) -> str:
        """Return the table."""
        lines = [
            f"Loading in 10 s at 3125 Hz, {1e9 * NOISE:g} nm noise; slopes in nm/V, T = k slope, "
            f"k = {STIFFNESS / 1e6:g} N/um",
            f"  {'':34s}{'first 2 V':>10s}{'last of 50 [95 %]':>24s}{'chord +-':>14s}{'T N/V':>8s}"
            f"{'off curve nm':>14s}",
        ]
        for r in self.rows:
            head = f"  {r.operator}, 0..{r.top:g} V"
            lines += [] if head in lines else [head]
            s = r.slopes
            lines.append(
                f"    {r.history:32s}{1e9 * s.first.value:10.2f}{_interval(s.last):>24s}"
                f"{1e9 * s.chord.value:8.2f} {1.96e9 * s.chord.standard_error:5.2f}"
                f"{transducer_constant(s.last, STIFFNESS).value:8.3f}{1e9 * r.off:14.1f}"
            )
        return "\n".join(lines)


@dataclass(frozen=True, slots=True)
class KnownTransducer:
    """Transducer constant (N/V) of a stack, as found and true; `share` is dV_t/dV at the end."""

    found: float
    true: float
    share: float

    def __str__(self) -> str:
        """Return the sentence."""
        return (
            f"Lumped stack with the Maxwell elements, T = {self.true:g} N/V: k slope = "
            f"{self.found:.3f} N/V ({100 * (self.found / self.true - 1):+.1f} %), as dV_t/dV = "
            f"{self.share:.4f} in the last segment"
        )


def erasing() -> ErasingStudy:
    """Erase the memory of both operators in several ways (section 6.1 of the thesis)."""
    found = []
    for name, operator in OPERATORS.items():
        thresholds, _ = _thresholds(operator)
        for history, signal in _histories(thresholds).items():
            left = float(operator.run(signal)[0][-1])
            since = signal[3:] if signal.size > 3 else signal
            ends = float(since.min()), float(since.max())
            found.append(Remanence(name, thresholds[-1], history, left, *ends))
    r, w = _thresholds(ALJ)
    least = sum(w_i * max(r_i - 20.0, 0.0) for r_i, w_i in zip(r, w, strict=True))
    plays = ALJ.as_prandtl_ishlinskii()
    rest = float(np.asarray(plays.run([50.0], memory=(50.0,) * plays.n_memory)[0])[0])
    decays = []
    for part in (0.5, 0.1, 0.02):
        step = part * float(np.diff(r).min())
        decay = demagnetisation(r, 50.0, step=step)
        left = max(
            abs(float(plays.run(np.concatenate((before, decay.volt)))[0][-1]) - rest)
            for before in ([0.0], [0.0, 100.0, 0.0], [0.0, 120.0, -20.0, 0.0])
        )
        # the decay begins half a step above the widest play
        bound = residual_bound(r, w, float(r[-1]) + 0.5 * step, step)
        decays.append(DecayRest(step, float(decay.time[-1]), left, bound))
    return ErasingStudy(tuple(found), least, tuple(decays))


def loading() -> LoadingStudy:
    """Load both operators after every history and take slopes (section 6.2)."""
    rows, curves = [], {}
    for top in (100.0, 60.0):
        ramp = loading_ramp(0.0, top)
        for name, operator in OPERATORS.items():
            fresh = np.zeros(0)
            for i, (history, before) in enumerate(_histories(_thresholds(operator)[0]).items()):
                clean = operator.run(np.concatenate((before, ramp.volt)))[0][-ramp.volt.size :]
                noise = NOISE * np.random.default_rng(i).standard_normal(clean.size)
                fresh = clean if i == 0 else fresh
                off = float(np.abs((clean - clean[0]) - (fresh - fresh[0])).max())
                slopes = loading_slopes(LoadingCurve(ramp.volt, clean + noise))
                rows.append(LoadingRow(top, name, history, slopes, off))
                if operator is ALJ and top == 100.0:
                    curves[history] = LoadingCurve(ramp.volt, clean)
    return LoadingStudy(tuple(rows), curves)


def known() -> KnownTransducer:
    """Apply the method to a stack whose transducer constant is known."""
    ramp = loading_ramp(0.0, 100.0, 10.0, 500.0)
    graph = stack_lumped(Hysteretic(MaxwellResistiveCapacitor.stack_2hz()))
    run = simulate(
        graph, ramp.time, {"V_in": ramp.volt}, observed=("e_clamp",), x0="rest", hold="linear"
    )
    last = loading_slopes(ramp.volt, run["x"]).last
    inside = ramp.volt >= last.window[0]
    share = float(np.polyfit(ramp.volt[inside], run["e_clamp"][inside], 1)[0])
    found = transducer_constant(last, STIFFNESS).value
    return KnownTransducer(found, graph.parameters["T"].value, share)


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


def _interval(slope: Slope) -> str:
    low, high = slope.ci95
    return f"{1e9 * slope.value:.3f} [{1e9 * low:.3f}, {1e9 * high:.3f}]"
