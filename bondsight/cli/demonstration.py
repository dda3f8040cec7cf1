"""The demo: a virtual plant conceals an effect, or nothing; the diagnosis has to say which."""

from __future__ import annotations

import json
import secrets
import time
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from shlex import quote
from typing import Any

import numpy as np
from joblib import delayed

from actuators.models.plants import plant_model
from bondgraph.graph.elements import Source
from bondgraph.graph.sensors import Sensor
from bondgraph.signals.recording import Recording
from bondgraph.signals.units import parse_unit
from bondgraph.support.errors import UnusableInput, unknown_name
from bondgraph.support.parallel import results
from bondgraph.support.whole_file import write_atomically
from bondsight.cli.judged import Outcome, judge, summary
from bondsight.cli.progress import Bar
from bondsight.cli.spoken import at_shell
from hardware.simulators.generator.prepared import PREPARED, prepared
from hardware.simulators.generator.showing import (
    NOTHING,
    SHOWN,
    draw_shown,
    effects_of,
    plants_of,
    shown,
)
from hardware.simulators.judging.truths import truth_of
from hardware.simulators.seal import SealedEnvelope
from identification.diagnosis.diagnose import Diagnosis, diagnose
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.diagnosis.studio import write_report
from identification.diagnosis.verdict.folder import write_verdict

TAUGHT = (1, "stack", "hysteresis")
"""Seed, plant and effect of the demo that nobody has asked anything of."""
HOLD = "linear"
"""What the command does between the samples, which a laboratory knows of its converter."""


@dataclass(frozen=True)
class Wish:
    """What the demo is asked for; the seed decides the rest.

    Raises
    ------
    UnusableInput
        There is no such plant or effect, or the plant cannot hide the effect.
    """

    plant: str | None = None
    effect: str | None = None

    def __post_init__(self) -> None:
        """Refuse what cannot be drawn."""
        if self.plant is not None and self.plant not in SHOWN:
            raise UnusableInput(str(unknown_name("plant", self.plant, "the demo", SHOWN)))
        if self.effect is not None and self.effect not in effects_of():
            raise UnusableInput(str(unknown_name("effect", self.effect, "the demo", effects_of())))
        if None not in (self.plant, self.effect) and self.plant not in plants_of(self.effect):
            raise UnusableInput(
                f"--effect {self.effect}: the plant {self.plant} has no place for it; take "
                f"--plant {', '.join(plants_of(self.effect))}"
            )


@dataclass(frozen=True)
class Concealed:
    """A recording that was written, and the sealed truth of it."""

    seed: int
    plant: str
    path: Path
    recording: Recording
    sealed: SealedEnvelope
    again: str = ""
    """What draws it again beside its seed."""

    def opened(self, found: Diagnosis) -> Outcome:
        """Open the seal and compare; the truth is checked against its hash."""
        return judge(truth_of(self.sealed.truth()), found)


def conceal(seed: int, wish: Wish, path: Path) -> Concealed:
    """Draw a plant, seal its truth, write its recording.

    Raises
    ------
    UnusableInput
        The plants cannot be compiled.
    """
    try:
        channels, truth = shown(seed, wish.plant, wish.effect)
    except OSError as error:
        raise UnusableInput(
            f"demo: {error}; without --seed, --seeds, --plant and --effect a recording is shown "
            "that was made beforehand"
        ) from None
    return _written(seed, channels, truth, path)


def _written(
    seed: int, channels: Mapping[str, Any], truth: Mapping[str, Any], path: Path
) -> Concealed:
    recording = _recording(channels, path.stem)
    recording.write_csv(path)
    return Concealed(seed, truth["plant"], path, recording, SealedEnvelope.closed(truth))


def begun(seed: int | None, wish: Wish, path: Path) -> Concealed:
    """Conceal something; what nobody has asked for is one case that teaches.

    A draw without a seed conceals an effect: finding none would teach little. Where nothing is
    asked for and nothing compiles, what was made beforehand is shown.

    Raises
    ------
    UnusableInput
        Something is asked for, and the plants cannot be compiled.
    """
    if seed is not None:
        return conceal(seed, wish, path)
    if wish != Wish():
        quiet = wish.effect == NOTHING
        tried = ((n, draw_shown(n, wish.plant, wish.effect)) for n in _by_chance())
        return conceal(next(n for n, case in tried if quiet or case.effects), wish, path)
    number, plant, effect = TAUGHT
    try:
        channels, truth = shown(number, plant, effect)
    except OSError as error:
        print(f"Made beforehand, since the virtual plants cannot be compiled here ({error}):")
        return replace(_written(PREPARED[0], *prepared(), path), again=_again(*PREPARED[1:]))
    return replace(_written(number, channels, truth, path), again=_again(plant, effect))


def _again(plant: str, effect: str) -> str:
    return f" --plant {plant} --effect {effect}"


def _by_chance() -> Iterator[int]:
    while True:
        yield secrets.randbits(32)


def _recording(channels: Mapping[str, Any], name: str) -> Recording:
    graph = plant_model(channels["plant"])
    units = {e.name: parse_unit(e.unit).si for e in graph.of_type(Source, Sensor)}
    data = {k: np.asarray(channels[k], float) for k in units}
    return Recording(name, np.asarray(channels["time"], float), data, units)


def run(made: Concealed, jobs: int, progress: Bar | None) -> Diagnosis:
    """Diagnose a recording from its file alone, by the model of its plant."""
    return diagnose(
        plant_model(made.plant),
        Recording.read(made.path),
        model=made.plant,
        options=DiagnosisOptions(jobs=jobs),
        hold=HOLD,
        progress=progress,
        seed=made.seed,
    )


def demo(seed: int | None, folder: Path, jobs: int, wish: Wish) -> int:
    """Seal a truth, diagnose its recording, open the seal; prints as it goes."""
    from identification.diagnosis.verdict.text import in_words

    folder.mkdir(parents=True, exist_ok=True)
    made = begun(seed, wish, folder / "recording.csv")
    units = made.recording.units
    print(f"{SHOWN[made.plant]} Something may be concealed in it.")
    print(f"truth sealed:   sha256 {made.sealed.hash}")
    print(f"recording:      {made.path} ({', '.join(f'{k} [{u}]' for k, u in units.items())})")
    print(f"declared model: {made.plant} (bondsight models {made.plant} describes it)")
    with Bar() as bar:
        found = run(made, jobs, bar)
    found = at_shell(found)
    print(f"\n{in_words(found)}")
    written, report = write_verdict(found, folder), write_report(found, folder)
    outcome = made.opened(found)
    print(f"\nseal opened:    {outcome.truth} (--seed {made.seed}{made.again})")
    print(f"the verdict is: {outcome.result}")
    print(f"verdict:        {written}\nreport:         {report}")
    again = f"bondsight diagnose {quote(str(made.path))} --model {made.plant} --hold {HOLD}"
    print(f"again by hand:  {again}")
    print(f"another one:    bondsight demo --seed {secrets.randbelow(1000)}")
    return 0


def score(count: int, first: int, folder: Path, jobs: int, wish: Wish) -> int:
    """Run `count` draws from seed `first` on and print how many were right."""
    if count < 1:
        raise UnusableInput(f"--seeds {count}: give at least one")
    folder.mkdir(parents=True, exist_ok=True)
    begin = time.perf_counter()
    found: dict[int, Outcome] = {}
    calls = (delayed(one)(seed, folder, wish) for seed in range(first, first + count))
    work = results(calls, jobs)
    with Bar() as bar:
        for seed, outcome in work:
            found[seed] = outcome
            bar(f"seed {seed}: {outcome.result}", len(found) / count)
            _print_line(seed, outcome)
    found = dict(sorted(found.items()))
    print(summary([*found.values()], time.perf_counter() - begin))
    target = folder / f"score_{first}_{first + count - 1}.json"
    rows = [{"seed": seed} | asdict(outcome) for seed, outcome in found.items()]
    write_atomically(target, json.dumps(rows, indent=1) + "\n")
    print(f"every draw: {target}")
    return 0


def one(seed: int, folder: Path, wish: Wish) -> tuple[int, Outcome]:
    """One draw in a process of its own."""
    path = folder / f"recording_{seed}.csv"
    try:
        made = conceal(seed, wish, path)
        return seed, made.opened(run(made, 1, None))
    finally:
        path.unlink(missing_ok=True)


def _print_line(seed: int, o: Outcome) -> None:
    after = "" if o.misfit_after is None else f" -> {o.misfit_after:.3g}"
    print(
        f"{o.result:12s} seed {seed:<6d} {o.plant:9s} {o.truth:52s} {o.said:44s} "
        f"misfit/floor {o.misfit_before:.3g}{after}  {o.seconds:.0f} s",
        flush=True,
    )
