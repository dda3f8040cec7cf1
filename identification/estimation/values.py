"""The values of a fit as one JSON document."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from bondgraph.support.whole_file import write_atomically
from identification.estimation.result import Estimation


def write_values(found: Estimation, path: Path) -> None:
    """Write values and errors as JSON, for other programs; `archive.save` keeps everything."""

    def number(v: float) -> float | None:
        return float(v) if abs(v) < float("inf") else None

    def row(e: Any) -> dict[str, Any]:
        return {
            "name": e.name, "value": number(e.value), "unit": e.unit,
            "ci95": [number(v) for v in e.ci95], "at_bound": bool(e.at_bound),
        }  # fmt: skip

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
    write_atomically(path, json.dumps(document, indent=2, allow_nan=False) + "\n")
