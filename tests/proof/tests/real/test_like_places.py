"""Groups of places that are alike, and what a kind does at all of them together."""

from __future__ import annotations

import numpy as np

from bondgraph import BondGraph, C, Dq, I, One, R, Se, Zero
from bondgraph.laws import Coulomb
from bondgraph.signals.recording import Recording
from bondgraph.simulation.simulate import simulate
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.search.candidates import DiagnosisOptions
from tests.proof.real.like_places import explained_together, like_places

T = np.arange(900) * 5e-3


def two_axes(friction: float = 0.0) -> BondGraph:
    """Two masses on springs, a force on each, and a soft spring between them."""
    law = Coulomb(friction, unit="N") if friction else None
    with BondGraph("axes") as g:
        axes = [One("axis_1"), One("axis_2")]
        for k, axis in enumerate(axes, start=1):
            Se(f"F_{k}", unit="N") >> axis >> I(f"m_{k}", 1.0, unit="kg")
            axis >> R(f"d_{k}", 3.0, law=law, unit="N*s/m")
            axis >> C(f"k_{k}", stiffness=400.0, unit="N/m")
            axis >> Dq(f"x_{k}", unit="m")
        between, stretch = Zero("between"), C("k_c", stiffness=40.0, unit="N/m")
        axes[0] >> between >> axes[1]
        between >> stretch
    return g


def test_places_are_alike_up_to_their_digits() -> None:
    assert like_places(["k_1", "m", "k_2", "y1", "y2", "z"]) == [("k_1", "k_2"), ("y1", "y2")]


def test_friction_on_both_axes_is_explained_on_both() -> None:
    rng = np.random.default_rng(1)
    forces = {f"F_{k}": np.repeat(rng.uniform(-9.0, 9.0, 30), 30) for k in ("1", "2")}
    made = simulate(two_axes(0.8), T, forces, hold="hold")
    read = {f"x_{k}[m]": made[f"x_{k}"] + 1e-4 * rng.standard_normal(T.size) for k in ("1", "2")}
    given = {f"{n}[N]": v for n, v in forces.items()}
    file = Recording.from_arrays("axes", {"t[s]": T, **given, **read})
    found = diagnose(two_axes(), file, options=DiagnosisOptions(jobs=1, keep=1, more=0, effects=1))
    parts = explained_together(found)
    assert parts[("d_1", "d_2"), "dissipative"] > 0.9
    assert parts[("k_1", "k_2"), "restoring"] < 0.5
