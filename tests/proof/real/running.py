"""Diagnose every real recording once, keep everything, and go on after an interruption."""

from __future__ import annotations

import json
import traceback
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from bondgraph.graph.sensors import Sensor
from bondgraph.signals.recording import Recording
from bondgraph.support.errors import UnusableInput
from identification.datasets import LoadedRecording, set_available
from tests.proof.real.case import RealCase
from tests.proof.real.judging import judge
from tests.proof.real.outcome import FILE, Outcome, documented, read_outcome, table
from tests.proof.real.preparing import stretches_of
from tests.proof.real.registry import REAL_CASES, chosen_cases

__all__ = ["Diagnose", "Progress", "collected", "run_cases"]

Progress = Callable[[str, float], None]
Diagnose = Callable[..., Any]
"""Stands for `identification.diagnosis.diagnose.diagnose`."""

TABLE, DATA = "real.md", "real.json"


def run_cases(
    folder: Path,
    only: Sequence[str] = (),
    jobs: int = -1,
    *,
    recordings: str | None = None,
    progress: Progress | None = None,
    finished: Callable[[Outcome], None] | None = None,
    diagnose: Diagnose | None = None,
) -> tuple[Outcome, ...]:
    """Diagnose the cases that have no outcome in `folder` yet.

    Every case writes ``verdict.json``, ``report.html`` and ``outcome.json`` into a folder of its
    name; a diagnosis that breaks off leaves ``failure.txt`` and is an outcome too, which is not
    tried again. After each case ``real.md`` and ``real.json`` hold the table of all so far.

    Parameters
    ----------
    folder : Path
        For the results.
    only : sequence of str
        Names of cases; all if empty.
    jobs : int
        Processes of a diagnosis; -1 takes all cores.
    recordings : str, optional
        Folder of the recordings; that of the environment if not given.
    progress : callable, optional
        Called with a text and a fraction between 0 and 1, for each case anew.
    finished : callable, optional
        Called with each outcome, also with those that were there.
    diagnose : callable, optional
        In place of the diagnosis, for tests.

    Returns
    -------
    tuple of Outcome
        Of the cases chosen, in the order of the registry. Recordings that are not there, or cannot
        be read, give the outcome ``absent``, which is not kept.

    Raises
    ------
    UnknownName
        There is no such case.
    """
    found = []
    for case in chosen_cases(only):
        place = folder / case.name
        made = read_outcome(place)
        if made is None:
            made = _attempt(case, place, jobs, recordings, progress, diagnose)
            if made.outcome != "absent":
                _write(place / FILE, made.text())
                _collect(folder)
        found.append(made)
        if finished is not None:
            finished(made)
    _collect(folder)
    return tuple(found)


def collected(folder: Path) -> tuple[Outcome, ...]:
    """Return every outcome in `folder`, in the order of the registry."""
    found = (read_outcome(folder / name) for name in REAL_CASES)
    return tuple(o for o in found if o is not None)


def _attempt(
    case: RealCase,
    place: Path,
    jobs: int,
    recordings: str | None,
    progress: Progress | None,
    diagnose: Diagnose | None,
) -> Outcome:
    plain = Outcome(
        case.name, case.label, "absent", documented=documented(case), comment=case.comment,
        published="" if case.published is None else str(case.published),
    )  # fmt: skip
    if not set_available(case.dataset, recordings):
        return plain
    try:
        loaded = case.load(recordings)
    except UnusableInput as error:
        return replace(plain, note=str(error))
    try:
        return _diagnosed(case, loaded, place, jobs, recordings, progress, diagnose, plain)
    except Exception as error:  # whatever it is, it belongs into the table
        _write(place / "failure.txt", traceback.format_exc())
        line = " ".join(f"{type(error).__name__}: {error}".split())
        return replace(plain, outcome="failed", failure=line)


def _diagnosed(
    case: RealCase,
    loaded: LoadedRecording,
    place: Path,
    jobs: int,
    recordings: str | None,
    progress: Progress | None,
    given: Diagnose | None,
    plain: Outcome,
) -> Outcome:
    from identification.diagnosis.diagnose import diagnose
    from identification.diagnosis.search.candidates import DiagnosisOptions
    from identification.diagnosis.studio import write_report
    from identification.diagnosis.verdict import verdict, write_verdict
    from tests.proof.real.official import official_errors

    recording, split = loaded
    stretches = stretches_of(recording)
    graph = case.model()
    result = (given or diagnose)(
        graph,
        stretches[0] if len(stretches) == 1 else stretches,
        split,
        model=case.name,
        options=DiagnosisOptions(jobs=jobs),
        progress=progress,
    )
    place.mkdir(parents=True, exist_ok=True)
    write_verdict(result, place)
    write_report(result, place)
    said = verdict(result)
    judged = judge(case, said)
    fit = said["fit"]
    official = official_errors(result, case.dataset, recordings) if case.official else {}
    kinds = dict.fromkeys(f["kind"] for f in said["findings"] if f["kind"])
    return replace(
        plain, outcome=judged.outcome, said=judged.said, place=judged.place, note=judged.note,
        kind=" + ".join(kinds), official=official,
        verdict=said["verdict"], before=fit["nominal"]["test_rmse"],
        after=fit["repaired"]["test_rmse"], floor=fit["noise_floor"],
        units=_units(graph.of_type(Sensor), recording), seconds=float(said["seconds"]),
        samples=recording.n, split=split.rule,
    )  # fmt: skip


def _units(sensors: Sequence[Sensor], recording: Recording) -> dict[str, str]:
    return {s.name: recording.units[s.name] for s in sensors}


def _collect(folder: Path) -> None:
    found = collected(folder)
    if found:
        _write(folder / TABLE, table(found))
        _write(folder / DATA, json.dumps([asdict(o) for o in found], indent=2) + "\n")


def _write(target: Path, text: str) -> None:
    from bondgraph.support.whole_file import write_atomically

    write_atomically(target, text)
