"""What the missing signal of a diagnosis looks like, recovered at its likeliest ports."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from bondgraph.support.errors import BondsightError
from identification.diagnosis.explanation.characterisation import characterise
from identification.diagnosis.explanation.latent_signal import latent
from identification.diagnosis.screening.port_response import probes
from identification.diagnosis.screening.tangent_space import freedom
from identification.study.residual import windows

if TYPE_CHECKING:
    from identification.diagnosis.diagnose import Diagnosis


def characterised(d: Diagnosis, ports: int = 2) -> Diagnosis:
    """Return the diagnosis with what the missing signal looks like at its likeliest ports.

    The signal is rebuilt from the residual of the nominal fit by smoothing, no law assumed.
    """
    if d.scene is None or d.nominal is None or d.kind not in ("missing_physics", "unknown_physics"):
        return d
    step = d.findings[0] if d.findings else d.decision
    if step is None:
        return d
    names = list(dict.fromkeys(t.element for t in sorted(step.trials, key=lambda t: t.test)))
    probed, found = probes(d.scene.nominal), {}
    for name in [n for n in names if probed.knows(n)][:ports]:
        try:
            signal = latent(
                partial(probed.respond, name), d.scene.residual,
                d.scene.data.floor, d.scene.data.dt, tangents=freedom(d.scene.nominal),
                windows=windows(d.scene.nominal.problem), scored=d.scene.data.mask("train"),
            )  # fmt: skip
            found[name] = (characterise(d.scene.past[name], signal.signal), signal)
        except (BondsightError, np.linalg.LinAlgError, ValueError):
            continue
    return replace(d, traits=found)
