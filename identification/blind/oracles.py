"""What a fit that is told the truth reaches: which effects can be told apart at all.

An effect is distinguishable if, after the nominal model is refitted, its excess over the noise
floor is above 3 dB and the fit of the true law at the true place beats the best rival of the
diagnosis by more than 3 standard errors on held-out data.
"""

from __future__ import annotations

import json
import math
import time
import traceback
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from bondgraph.errors import BondsightError
from identification.blind.answers import Answer
from identification.blind.layout import Layout
from identification.blind.running import Progress, finite, graph_of, recording_of, run_all
from identification.blind.truths import Public, Truth
from identification.diagnosis.effects import CATALOGUE
from identification.diagnosis.search import Options

__all__ = ["LEAST_EXCESS", "LEAST_Z", "OracleAnswer", "ask_oracles", "read_oracles", "repair_ratio"]

LEAST_Z = 3.0
"""Standard errors by which the true law must beat the best rival."""
LEAST_EXCESS = 3.0
"""dB of the nominal misfit over the noise floor."""


@dataclass(frozen=True, slots=True)
class OracleAnswer:
    """What the truth reaches on one recording.

    Attributes
    ----------
    rmse : mapping
        Held-out error with the true law, by sensor, SI.
    z : float
        Standard errors by which it beats the best rival.
    excess : float
        Held-out misfit of the nominal model over the floor, dB.
    """

    id: str
    rmse: Mapping[str, float]
    chi2: float
    z: float
    excess: float
    error: str = ""

    @property
    def detectable(self) -> bool:
        """Whether enough of the effect shows beside the noise."""
        return self.excess > LEAST_EXCESS

    @property
    def separable(self) -> bool:
        """Whether the truth can be told from its best rival."""
        return self.z > LEAST_Z

    @property
    def distinguishable(self) -> bool:
        """Whether a name can be asked for."""
        return self.detectable and self.separable


@dataclass(frozen=True, slots=True)
class _Oracle:
    """Work for one recording; travels to the processes with the truths."""

    truths: Mapping[str, Truth]

    def __call__(self, layout: Layout, public: Public, seed: int) -> dict[str, Any]:
        """Fit the true law at the true place."""
        from identification.diagnosis.oracle import oracle

        begin = time.perf_counter()
        (effect,) = self.truths[public.id].effects
        content: dict[str, Any] = {"id": public.id, "error": None, "result": None}
        try:
            recording = recording_of(layout, public)
            graph = graph_of(public, recording)
            options = replace(Options(), jobs=1)
            found = oracle(graph, recording, effect.effect, effect.element, options)
            content["result"] = {
                "test_rmse": {n: float(v) for n, v in found.test_rmse.items()},
                "chi2": finite(found.chi2),
                # a rival that cannot be simulated loses by any number of standard errors
                "z": 99.0 if found.z == math.inf else finite(found.z),
                "excess_db": finite(found.excess_db),
            }
        except BondsightError as error:
            content["error"] = " ".join(str(error).split())
        except Exception:  # counted as not distinguishable, and listed
            content["error"] = traceback.format_exc(limit=-6)
        return content | {"seconds": round(time.perf_counter() - begin, 3)}


def ask_oracles(
    layout: Layout,
    public: Sequence[Public],
    truths: Mapping[str, Truth],
    *,
    jobs: int = -1,
    progress: Progress | None = None,
) -> int:
    """Fit the truth of every recording with one effect of the catalogue; resumes."""
    known = {e.name for e in CATALOGUE}
    asked = [
        p
        for p in public
        if truths[p.id].cell in ("single", "look_alike", "form")
        and truths[p.id].effects[0].effect in known
    ]
    return run_all(layout, asked, layout.oracle, _Oracle(truths), jobs=jobs, progress=progress)


def read_oracles(folder: Path) -> dict[str, OracleAnswer]:
    """Read what the oracles found, by recording; what failed has nan and an error."""
    found = {}
    for path in sorted(folder.glob("*.json")):
        content = json.loads(path.read_text(encoding="utf-8"))
        result = content.get("result") or {}

        def number(name: str, result: Mapping[str, Any] = result) -> float:
            value = result.get(name)
            return float("nan") if value is None else float(value)

        found[str(content["id"])] = OracleAnswer(
            str(content["id"]),
            result.get("test_rmse") or {},
            number("chi2"),
            number("z"),
            number("excess_db"),
            str(content.get("error") or ""),
        )
    return found


def repair_ratio(answer: Answer, oracle: OracleAnswer) -> float:
    """Held-out error after the repair over the oracle's, geometric mean of the sensors.

    Without a repair the error of the model as it is counts: abstention is no way round the gate.
    """
    reached = answer.repaired_rmse or answer.nominal_rmse or {}
    logs = [
        math.log(reached[n] / best)
        for n, best in oracle.rmse.items()
        if best > 0 and reached.get(n, 0.0) > 0
    ]
    return math.exp(sum(logs) / len(logs)) if logs else float("nan")
