"""Print the verdict of a diagnosis of two recordings, called from Python."""

from __future__ import annotations

import json

from models import positioner  # type: ignore[import-not-found]
from vocabulary import Options, Recording, diagnose, verdict  # type: ignore[import-not-found]

MAP = {"F": "F", "x": "x_um"}
records = [Recording.read(name, map=MAP) for name in ("coulomb.csv", "coulomb_other.csv")]
found = diagnose(positioner(), records, options=Options(jobs=1, effects=1, without=("delay",)))
print(json.dumps(verdict(found), indent=1, allow_nan=False))
