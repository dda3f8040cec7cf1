"""The embedded default: a virtual bench conceals an effect, the diagnosis has to find it."""

from __future__ import annotations

import json
import secrets
import sys
import time
from collections import Counter
from dataclasses import asdict, dataclass
from pathlib import Path

from joblib import delayed

from actuators.models.catalogue import stack_with_payload
from bondgraph.signals.recording import Recording
from bondgraph.support.errors import UnusableInput, unknown_name
from bondgraph.support.parallel import results
from bondgraph.support.whole_file import write_atomically
from bondsight.cli.progress import Bar
from hardware.simulators import Truth, draw_truth, effects, record, seal
from identification.diagnosis.diagnose import Diagnosis, diagnose
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.diagnosis.studio import write_report
from identification.diagnosis.verdict.document import verdict, write_verdict

CHANNELS = {"V_in": "V", "x": "x", "i": "i"}
PLACES = {"b": "R_nl"}
"""Names the bench has for places, in the words of the model."""


@dataclass(frozen=True)
class Outcome:
    """One draw of the bench beside its verdict.

    Attributes
    ----------
    result : str
        ``right``, ``look-alikes``, ``abstained``, ``missed``, ``wrong`` or ``false alarm``.
    """

    seed: int
    effect: str
    place: str
    strength: str
    kind: str
    named: str
    named_place: str
    result: str
    confidence: float
    misfit_before: float
    misfit_after: float | None
    seconds: float


def demo(seed: int | None, folder: Path, jobs: int, effect: str | None = None) -> int:
    """Seal a truth, diagnose its recording, open the seal; prints as it goes."""
    seed = secrets.randbits(32) if seed is None else seed
    folder.mkdir(parents=True, exist_ok=True)
    print("A virtual P-840.1 piezo stack moves 0.1 kg. Something may be concealed in it.")
    truth = draw_truth(seed, effect=effect)
    sealed = seal(truth)
    print(f"truth sealed:   sha256 {sealed.hash}")
    path = folder / "recording.csv"
    record(truth, seed).write_csv(path)
    print(f"recording:      {path} (command V, displacement x, current i)")
    with Bar(quiet=not sys.stderr.isatty()) as bar:
        result = run(path, jobs, bar, seed)
    from identification.diagnosis.verdict.text import in_words

    print()
    print(in_words(result))
    written, report = write_verdict(result, folder), write_report(result, folder)
    opened = sealed.open()
    outcome = judge(opened, result)
    print()
    print(f"seal opened:    {describe(opened)} (seed {seed})")
    print(f"the verdict is: {outcome.result}")
    print(f"verdict:        {written}\nreport:         {report}")
    return 0


def run(path: Path, jobs: int, progress: Bar | None, seed: int) -> Diagnosis:
    """Diagnose a bench recording from its file alone."""
    recording = Recording.read(path, map=CHANNELS)
    return diagnose(
        stack_with_payload(),
        recording,
        model="stack_with_payload",
        options=DiagnosisOptions(jobs=jobs),
        progress=progress,
        seed=seed,
    )


def describe(truth: Truth) -> str:
    """Concealed effect in words."""
    if truth.effect.name == "none":
        return "nothing was concealed"
    place = PLACES.get(truth.effect.place, truth.effect.place)
    return f"{truth.strength} {truth.effect.name} at {place}"


def judge(truth: Truth, d: Diagnosis) -> Outcome:
    """Compare a verdict with the opened truth."""
    v = verdict(d)
    place = PLACES.get(truth.effect.place, truth.effect.place)
    finding = v["findings"][0] if v["findings"] else None
    named = finding["effect"] if finding else ""
    where = finding["location"]["element"] if finding else ""
    places = [where, *finding["location"]["indistinguishable_from"]] if finding else []
    possible = {(p["effect"], p["element"]) for p in finding["also_possible"]} if finding else set()
    if truth.effect.name == "none":
        result = (
            "false alarm" if v["verdict"] in ("missing_physics", "unknown_physics") else "right"
        )
    elif v["verdict"] == "missing_physics":
        if named == truth.effect.name and place in places:
            result = "right"
        else:
            result = "look-alikes" if (truth.effect.name, place) in possible else "wrong"
    elif v["verdict"] == "unknown_physics":
        result = "look-alikes" if (truth.effect.name, place) in possible else "abstained"
    else:
        result = "missed"
    return Outcome(
        truth.seed, truth.effect.name, place, truth.strength, v["verdict"], named, where, result,
        finding["confidence"] if finding else 0.0,
        d.nominal.chi2("test") if d.nominal else float("nan"),
        d.repaired.chi2("test") if d.repaired else None,
        d.seconds,
    )  # fmt: skip


def score(count: int, first: int, folder: Path, jobs: int, effect: str | None = None) -> int:
    """Run `count` draws from seed `first` on and print how many were right."""
    if count < 1:
        raise UnusableInput(f"--seeds {count}: give at least one")
    folder.mkdir(parents=True, exist_ok=True)
    begin = time.perf_counter()
    found: list[Outcome] = []
    calls = (delayed(one)(seed, folder, effect) for seed in range(first, first + count))
    work = results(calls, jobs)
    with Bar(quiet=not sys.stderr.isatty()) as bar:
        for outcome in work:
            found.append(outcome)
            bar(f"seed {outcome.seed}: {outcome.result}", len(found) / count)
            _print_line(outcome)
    found.sort(key=lambda o: o.seed)
    print(summary(found, time.perf_counter() - begin))
    target = folder / f"score_{first}_{first + count - 1}.json"
    write_atomically(target, json.dumps([asdict(o) for o in found], indent=1) + "\n")
    print(f"every draw: {target}")
    return 0


def one(seed: int, folder: Path, effect: str | None) -> Outcome:
    """One draw in a process of its own."""
    truth = draw_truth(seed, effect=effect)
    path = folder / f"recording_{seed}.csv"
    record(truth, seed).write_csv(path)
    try:
        return judge(truth, run(path, 1, None, seed))
    finally:
        path.unlink(missing_ok=True)


def summary(found: list[Outcome], seconds: float) -> str:
    """Return counts, in total and by effect."""
    kinds = ("right", "look-alikes", "abstained", "missed", "wrong", "false alarm")
    total = Counter(o.result for o in found)
    lines = [
        "",
        ", ".join(f"{k} {total[k]}" for k in kinds) + f" of {len(found)} in {seconds:.0f} s",
    ]
    for name in sorted({o.effect for o in found}):
        part = Counter(o.result for o in found if o.effect == name)
        lines.append(f"  {name:22s} " + ", ".join(f"{k} {part[k]}" for k in kinds if part[k]))
    return "\n".join(lines)


def _print_line(o: Outcome) -> None:
    truth = o.effect if o.effect == "none" else f"{o.strength} {o.effect} at {o.place}"
    answer = f"{o.named} at {o.named_place}" if o.named else o.kind
    after = "" if o.misfit_after is None else f" -> {o.misfit_after:.3g}"
    print(
        f"{o.result:12s} seed {o.seed:<6d} {truth:38s} {answer:38s} "
        f"misfit/floor {o.misfit_before:.3g}{after}  {o.seconds:.0f} s",
        flush=True,
    )


def known_effect(effect: str | None) -> None:
    """Refuse an effect that the bench does not have."""
    if effect is not None and effect not in effects():
        raise UnusableInput(str(unknown_name("effect", effect, "the bench", effects())))
