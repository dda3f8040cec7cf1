"""The values of a fit as one JSON document."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bondgraph.support.whole_file import write_atomically
from identification.estimation.result import Estimation

if TYPE_CHECKING:
    from identification.uncertainty.tied import Tied


def write_values(found: Estimation, path: Path, tied: Sequence[Tied] = ()) -> None:
    """Write values and errors as JSON, for other programs; `archive.save` keeps everything.

    Parameters
    ----------
    tied : sequence of Tied
        Parameters that are told only together: they have no interval of their own.
    """
    alone = {n: t.remark for t in tied for n in t.names}

    def number(v: float) -> float | None:
        return float(v) if abs(v) < float("inf") else None

    def row(e: Any) -> dict[str, Any]:
        remark = alone.get(e.name, "")
        return {
            "name": e.name, "value": number(e.value), "unit": e.unit,
            "ci95": [None if remark else number(v) for v in e.ci95], "at_bound": bool(e.at_bound),
        } | ({"remark": remark} if remark else {})  # fmt: skip

    document = {
        "schema": "bondsight.fit/1",
        "model": found.study.graph.name,
        "method": found.method,
        "optimiser": found.optimiser,
        "status": found.status.name.lower(),
        "parameters": [row(e) for e in found.estimates],
        "nuisances": [row(e) for e in found.nuisances],
        "cost": number(found.cost),
        "recordings": [
            {
                "name": name,
                "sha256": found.study.records[r].sha256,
                "samples": found.study.records[r].n,
                "train_rmse": {n: number(v) for n, v in found.rmse("train", r).items()},
                "test_rmse": {n: number(v) for n, v in found.rmse("test", r).items()},
            }
            for r, name in enumerate(found.record_names)
        ],
        "notes": list(found.notes),
        "seconds": found.seconds,
    }
    if tied:
        document["together"] = [t.document for t in tied]
    write_atomically(path, json.dumps(document, indent=2, allow_nan=False) + "\n")
