"""A unit is found where the fit, which ended in a wrong valley, points at no channel."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bondgraph import GY, BondGraph, Df, I, One, R, Se
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.screening import values_back
from identification.diagnosis.search.candidates import DiagnosisOptions
from tests.settled import simulate


def motor(r: float, k: float, j: float, b: float) -> BondGraph:
    with BondGraph("motor") as g:
        coil, shaft = One("coil"), One("shaft")
        Se("U", unit="V") >> coil >> R("R_a", r, unit="ohm")
        coil >> Df("i", unit="A")
        coil >> GY("K", k, unit="N*m/A") >> shaft >> I("J", j, unit="kg*m2")
        shaft >> R("b", b, unit="N*m*s/rad")
        shaft >> Df("w", unit="rad/s")
    return g


def written(path: Path, many: float) -> Path:
    """Write speeds that are so many times too large under a header of rad/s."""
    rng = np.random.default_rng(3)
    t = np.asarray(2e-3 * np.arange(2000), np.float64)
    u = 6.0 * np.sign(np.sin(2 * np.pi * (0.4 + 0.5 * t) * t))
    made = simulate(motor(0.9, 0.1, 1.3e-3, 2e-3), t, {"U": u})
    seen = {n: np.asarray(made[n]) for n in ("i", "w")}
    noisy = {n: v + 1e-3 * v.std() * rng.standard_normal(t.size) for n, v in seen.items()}
    table = np.column_stack((t, u, noisy["i"], many * noisy["w"]))
    np.savetxt(path, table, delimiter=",", header="t[s],U[V],i[A],w[rad/s]", comments="")
    return path


@pytest.mark.long
def test_usual_units_of_every_channel_are_tried_where_nothing_points_at_one(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(values_back, "suspects", lambda *_: ())
    declared, options = motor(1.0, 0.12, 1e-3, 3e-3), DiagnosisOptions(jobs=1)
    found = diagnose(declared, written(tmp_path / "rpm.csv", 30 / np.pi), options=options)
    (mistake,) = found.doubted
    assert mistake.claim.endswith("as rpm read as rad/s")
    right = diagnose(declared, written(tmp_path / "right.csv", 1.0), options=options)
    assert right.doubted == right.mistakes == ()
