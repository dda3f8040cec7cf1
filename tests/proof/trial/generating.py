"""Draw a trial, make its recordings, list what is public, seal the rest."""

from __future__ import annotations

import json
import secrets
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from joblib import delayed

from bondgraph.support.errors import UnusableInput
from bondgraph.support.parallel import results
from bondgraph.support.whole_file import write_atomically
from hardware.simulators.generator.case import DrawnCase
from hardware.simulators.generator.making_exam import exam_record
from hardware.simulators.generator.parameters import ALL_PLANTS
from hardware.simulators.generator.writing import Make, generate, load_case
from tests.proof.trial.commitment import DESIGN, commit
from tests.proof.trial.design import COUNTS, draw_trial
from tests.proof.trial.layout import Layout

HOLDS: Mapping[str, str] = {"zero": "hold", "linear": "linear"}
"""The generator's words for what a command does between samples, in the tool's."""
Progress = Callable[[str, float], None]


def generate_trial(
    layout: Layout,
    kind: str,
    *,
    count: int | None = None,
    seed: int | None = None,
    jobs: int = -1,
    progress: Progress | None = None,
) -> int:
    """Draw and make a trial and commit to it; returns the number of recordings.

    An interrupted call goes on with the salt that it drew, if it is asked for the same.

    Parameters
    ----------
    kind : {"trial", "quick", "development"}
        Development takes a seed, the others a salt from the operating system.
    count : int, optional
        Recordings, of development only.

    Raises
    ------
    UnusableInput
        Unknown kind, a seed or a count where there is none, a trial without its design, one that
        is committed already, or one that was begun with another kind or seed.
    """
    if kind not in COUNTS:
        raise UnusableInput(f"{kind!r} is no kind of trial; take one of {', '.join(COUNTS)}")
    if kind != "development" and (seed is not None or count is not None):
        raise UnusableInput(
            f"a {kind} trial takes its salt from the operating system and has a fixed number of "
            "recordings; leave --seed and --count out, or take --kind development"
        )
    if layout.commitment.exists():
        raise UnusableInput(
            f"{layout.commitment}: this trial is committed already; take another folder"
        )
    if kind == "trial" and not DESIGN.is_file():
        raise UnusableInput(f"{DESIGN}: a trial has a design first; write and commit it")
    salt = _salt(layout, kind, seed)
    cases = draw_trial(kind, salt, count)
    truths = make_all(cases, layout, exam_record, jobs, progress)
    commit(layout, truths, salt, kind)
    return len(cases)


def _salt(layout: Layout, kind: str, seed: int | None) -> str:
    """Return the salt of an interrupted call, else a new one (from the seed, in development)."""
    if layout.salt.exists():
        return _begun(layout, kind, seed)
    salt = f"{kind} {seed or 0}" if kind == "development" else secrets.token_hex(32)
    write_atomically(layout.drawn, kind + "\n")
    write_atomically(layout.salt, salt + "\n")
    layout.salt.chmod(0o600)
    return salt


def _begun(layout: Layout, kind: str, seed: int | None) -> str:
    """Return the salt that lies there, if it is one of this kind and seed."""
    salt = layout.salt.read_text(encoding="ascii").strip()
    drawn = layout.drawn.read_text(encoding="ascii").strip() if layout.drawn.exists() else ""
    of_seed = salt.startswith("development")
    # a salt that was brought from another machine does not say which sealed kind it is of
    drawn = drawn or ("development" if of_seed else kind if kind != "development" else "sealed")
    if drawn != kind or (of_seed and seed is not None and salt != f"{kind} {seed}"):
        what = f"{drawn} trial" + (f" of seed {salt.split()[-1]}" if of_seed else "")
        raise UnusableInput(
            f"{layout.salt}: a {what} was begun here; go on with that, or take another folder"
        )
    return salt


def make_all(
    cases: Sequence[DrawnCase], layout: Layout, make: Make, jobs: int, progress: Progress | None
) -> list[dict[str, Any]]:
    """Make the recordings that are not there, list what is public, return all truths."""
    made = results((delayed(_make)(case, layout, make) for case in cases), jobs)
    for done, name in enumerate(made, start=1):
        if progress is not None:
            progress(f"recording {name}", done / len(cases))
    truths = generate(cases, layout.data, make=make)  # all are there: this only lists them
    write_public(layout, [case.id for case in cases])
    return truths


def _make(case: DrawnCase, layout: Layout, make: Make) -> str:
    # the list of truths that this call writes is written anew at the end
    generate([case], layout.data, make=make)
    return case.id


def write_public(layout: Layout, names: Sequence[str]) -> None:
    """List what the tool may know of each recording, read from the recordings themselves."""
    rows: list[dict[str, Any]] = []
    for name in names:
        seen = load_case(layout.data, name)
        plant = str(seen["plant"])
        units = np.asarray(seen["declared_resolution"], float)
        rows.append(
            {
                "id": name,
                "plant": plant,
                "sensors": [k for k in ALL_PLANTS[plant].sensors if k in seen],
                "hold": HOLDS[str(seen["hold"])],
                "delay": float(seen["declared_delay"]),
                "resolution": units.tolist(),
            }
        )
    text = json.dumps({"schema": "bondsight.blind-public/1", "recordings": rows}, indent=1)
    write_atomically(layout.public, text + "\n")
