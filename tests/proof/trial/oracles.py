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

import numpy as np

from bondgraph.support.errors import BondsightError
from identification.diagnosis.catalogue import CATALOGUE
from identification.diagnosis.catalogue.effect import Insertion
from identification.diagnosis.diagnose import Diagnosis, diagnose
from identification.diagnosis.search.candidates import Candidate, DiagnosisOptions
from identification.statistics.blocks import paired_z
from tests.proof.trial.answers import Answer
from tests.proof.trial.layout import Layout
from tests.proof.trial.nesting import containing
from tests.proof.trial.oracle import oracle
from tests.proof.trial.running import Progress, finite, graph_of, recording_of, run_all
from tests.proof.trial.truths import Public, TrueEffect, Truth

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
        begin = time.perf_counter()
        content: dict[str, Any] = {"id": public.id, "error": None, "result": None}
        try:
            content["result"] = _asked(layout, public, self.truths[public.id].effects[0], seed)
        except BondsightError as error:
            content["error"] = " ".join(str(error).split())
        except Exception:  # counted as not distinguishable, and listed
            content["error"] = traceback.format_exc(limit=-6)
        return content | {"seconds": round(time.perf_counter() - begin, 3)}


def _asked(layout: Layout, public: Public, true: TrueEffect, seed: int) -> dict[str, Any] | None:
    """Return what the truth reaches beside the rivals that the diagnosis fitted."""
    path = layout.answers / f"{public.id}.json"
    answered = json.loads(path.read_text(encoding="utf-8")).get("trials") or []
    # only the nominal fit is wanted here: nothing of the catalogue is tried again
    nothing = DiagnosisOptions(jobs=1, without=tuple(e.name for e in CATALOGUE), effects=1)
    base = diagnose(
        graph_of(public), recording_of(layout, public), options=nothing, hold=public.hold, seed=seed
    )
    rivals = tuple(_rival(t, base) for t in answered if _is_rival(t, true))
    found = oracle(
        replace(base, trials=rivals),
        [(true.effect, true.element)],
        replace(DiagnosisOptions(), jobs=1),
    )
    if found is None:
        return None
    result = {
        "test_rmse": dict(found.test_rmse),
        "chi2": finite(found.test),
        "z": finite(min(found.z, 99.0)),
        "gain_z": finite(min(found.gain_z, 99.0)),
        "excess_db": finite(found.excess_db),
    }
    own = [
        t
        for t in answered
        if (t["effect"], t["element"]) == (true.effect, true.element) and t["test"] is not None
    ]
    if own and own[0]["test"] < found.test and None not in own[0]["blocks"]:
        # the diagnosis found a better minimum for the very same effect
        blocks = np.array(own[0]["blocks"])
        same = [r.blocks for r in rivals if r.blocks.shape == blocks.shape]
        z = min((paired_z(b, blocks) for b in same), default=10.0)
        result |= {"test_rmse": own[0]["test_rmse"], "chi2": own[0]["test"], "z": min(z, 99.0)}
    return result


def _is_rival(trial: Mapping[str, Any], true: TrueEffect) -> bool:
    """Whether a fitted effect competes: not the truth, nor a law that contains it."""
    return (
        trial["effect"] not in {*containing(true.effect), "unknown"}
        and trial["home"]
        and trial["test"] is not None
        and None not in trial["blocks"]
    )


def _rival(trial: Mapping[str, Any], base: Diagnosis) -> Candidate:
    """Return a trial of the run as far as the oracle looks at it."""
    assert base.nominal is not None
    name, element = str(trial["effect"]), str(trial["element"])
    insertion = Insertion(name, str(trial["family"]), "", element, base.graph, (), ())
    test = float(trial["test"])
    return Candidate(insertion, True, base.nominal, test, test, np.array(trial["blocks"], float))


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
        if truths[p.id].cell in ("single", "look_alike")
        and not truths[p.id].empty
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
