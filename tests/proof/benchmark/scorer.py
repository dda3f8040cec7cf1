"""Score of a benchmark: truths and answers in, counts out. This file needs NumPy and nothing else.

    python scorer.py truths.json ANSWERS [--recordings FOLDER]

ANSWERS is a folder of JSON files or one file with an answer a line. What an answer holds stands in
``answer.schema.json``; what is counted, and beside it the exact 95 % interval, in the table.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np

SHOWS = 3.0
"""An effect shows if it moves a reading by more than this many times its noise (rms)."""
MISFIT = 3.0
"""A misfit above this many times the noise must not be called complete."""
LEFT, SLIGHT = 1.0, 0.3
"""A misfit above, and one that is none, over the noise."""

Json = Mapping[str, Any]
Counts = dict[str, tuple[int, int]]
ANSWERS = ("exact", "approximate", "look_alikes", "family", "kind", "unknown")
NAMES = ("exact", "approximate", "look_alikes")


def finding_of(row: Json) -> dict[str, Any]:
    """Return a finding with every field; an answer that is not stated follows from the others."""
    found: dict[str, Any] = {
        "names": set(map(str, row.get("names") or ())),
        "also_names": set(map(str, row.get("also_names") or ())),
        "places": set(map(str, row.get("places") or ())),
        "also_places": set(map(str, row.get("also_places") or ())),
        "family": str(row.get("family") or ""),
        "kind": str(row.get("kind") or ""),
        "probability": row.get("probability"),
    }
    follows = "unknown"
    for answer, is_so in (
        ("exact", len(found["names"]) == 1), ("look_alikes", len(found["names"]) > 1),
        ("family", found["family"]), ("kind", found["kind"]),
    ):  # fmt: skip
        if is_so:
            follows = answer
            break
    found["answer"] = str(row.get("answer") or follows)
    if found["answer"] not in ANSWERS:
        raise ValueError(f"answer {found['answer']!r} is none of {', '.join(ANSWERS)}")
    return found


class Judged:
    """One finding beside the truth; None where it says nothing of the sort."""

    def __init__(self, row: Json, truth: Json, families: Mapping[str, Sequence[str]]) -> None:
        f = finding_of(row)
        self.said, self.answer = f, str(f["answer"])
        effects = list(range(len(truth["effects"])))
        named = self.answer in (*NAMES, "family") and not truth["empty"]

        def of(i: int, what: str) -> set[str]:
            return set(truth["effects"][i][what])

        self.name: bool | None = None
        spoken = effects
        if named and self.answer == "family":
            if not truth["outside"]:
                kin = [
                    i
                    for i in effects
                    if f["family"] == truth["effects"][i]["family"]
                    or of(i, "names") & set(families.get(f["family"], ()))
                ]
                self.name, spoken = bool(kin), kin or effects
        elif named:
            same = [i for i in effects if of(i, "names") & f["names"]]
            self.name, spoken = bool(same), same or effects
        here = [i for i in spoken if of(i, "places") & f["places"]]
        # more than half of all elements are no place
        self.placed = 0 < 2 * len(f["places"]) <= max(truth["ports"], 2)
        self.place = bool(here) if self.placed and not truth["empty"] else None
        self.about = here or spoken
        told = bool(f["kind"]) and bool(self.about)
        self.kind = any(f["kind"] in of(i, "kinds") for i in self.about) if told else None
        self.exactly = self.name is True and self.answer in ("exact", "approximate")
        self.pinned = self.exactly and self.place is True
        self.holds = self.exactly and self.place is not False


class Outcome:
    """A recording's answer beside its truth."""

    def __init__(self, truth: Json, answer: Json, families: Mapping[str, Sequence[str]]) -> None:
        self.truth, self.said, self.families = truth, answer, families
        self.crash, self.mistake = bool(answer.get("error")), bool(answer.get("mistake"))
        self.mixed_up = truth["cell"] == "mixed_up"
        alarm = answer.get("alarm")
        self.alarm, self.quiet = alarm is True, alarm is False
        self.undecided = alarm is None and not self.crash
        self.claims = [Judged(f, truth, families) for f in answer.get("findings") or ()]
        self.left = math.nan if truth["left"] is None else float(truth["left"])
        moved = [e["moved"] for e in truth["effects"]]
        self.main = int(np.argmax(moved)) if moved else -1
        self.found = {i for c in self.claims if c.pinned for i in c.about}

    @property
    def main_shows(self) -> bool:
        """One main effect with a name, and it shows."""
        return bool(self.truth["single"]) and self.moved(self.main) > SHOWS

    def moved(self, i: int) -> float:
        """What an effect moves, over the noise."""
        return float(self.truth["effects"][i]["moved"])

    def main_set(self, what: str) -> set[str]:
        """Names or places of the main effect."""
        return set(self.truth["effects"][self.main][what])

    @property
    def here(self) -> list[Judged]:
        """Claims about the main effect at its place."""
        return [c for c in self.claims if c.place is True and self.main in c.about]

    @property
    def word(self) -> str:
        """One word for what came of it."""
        if self.crash:
            return "crash"
        if self.truth["empty"]:
            return "alarm" if self.alarm else "quiet" if self.quiet else "insufficient"
        if any(c.name is False for c in self.claims):
            return "wrong name"
        if any(c.place is False for c in self.claims):
            return "wrong place"
        if any(c.pinned for c in self.claims):
            return "right"
        for word, answers in (
            ("name only", NAMES[:2]), ("set", NAMES[2:]), ("family", ("family",)),
            ("kind", ("kind",)),
        ):  # fmt: skip
            if any(c.answer in answers for c in self.claims):
                return word
        if self.alarm:
            return "placed" if any(c.place for c in self.claims) else "unknown"
        return "missed" if self.quiet else "insufficient"


def judge(truths: Json, answers: Iterable[Json]) -> list[Outcome]:
    """Lay every answer beside its truth, in the order of the ids.

    Raises
    ------
    ValueError
        An answer cannot be used; the line says which and why.
    """
    by_id: dict[str, Json] = {}
    known = {str(t["id"]): t for t in truths["recordings"]}
    families = truths["families"]
    vocabulary = {n for names in families.values() for n in names}
    for a in answers:
        if str(a["id"]) in by_id:
            raise ValueError(f"{a['id']}: answered twice")
        if not any(a.get("alarm") is v for v in (True, False, None)):
            raise ValueError(f"{a['id']}: alarm is true, false or null, not {a['alarm']!r}")
        for name in (n for f in a.get("findings") or () for n in f.get("names") or ()):
            if name not in vocabulary:
                near = ", ".join(get_close_matches(str(name), vocabulary))
                raise ValueError(f"{a['id']}: no effect is called {name!r}; near: {near or '-'}")
        by_id[str(a["id"])] = a
    return [Outcome(known[i], by_id[i], families) for i in sorted(by_id) if i in known]


def share(values: Iterable[bool]) -> tuple[int, int]:
    """Count the true ones."""
    found = [bool(v) for v in values]
    return sum(found), len(found)


def count(outcomes: Sequence[Outcome]) -> Counts:
    """Return every rate as hits and total, by what it counts."""
    return {**_errors(outcomes), **_sharp(outcomes), **_several(outcomes)}


def _errors(outcomes: Sequence[Outcome]) -> Counts:
    controls = [o for o in outcomes if o.truth["empty"]]
    concealing = [o for o in outcomes if not o.truth["empty"]]
    outside = [o for o in concealing if o.truth["outside"] and not o.mixed_up]
    said = [c for o in concealing for c in o.claims]
    inside = [c for o in concealing if not o.truth["outside"] or o.mixed_up for c in o.claims]

    def exact(o: Outcome) -> bool:
        return any(c.answer == "exact" for c in o.claims)

    return {
        "false alarms, of the controls": share(o.alarm for o in controls),
        "insufficient data, of the controls": share(o.undecided for o in controls),
        "misfit above 3 times the noise, of those called explained": share(
            o.left > MISFIT for o in outcomes if o.quiet
        ),
        "called explained, of those where an effect shows": share(
            o.quiet and o.left > SLIGHT for o in concealing if o.truth["shows"]
        ),
        "wrong names, of the names given": share(
            c.name is False for c in inside if c.name is not None
        ),
        "wrong exact names, of those given": share(
            c.name is False for c in inside if c.answer == "exact"
        ),
        "wrong approximate names, of those given": share(
            c.name is False for c in inside if c.answer == "approximate"
        ),
        "wrong places, of the places given": share(
            c.place is False for c in said if c.place is not None
        ),
        "wrong kinds, of the kinds given": share(
            c.kind is False for c in said if c.kind is not None
        ),
        "outside the catalogue named exactly": share(exact(o) for o in outside),
        "outside named exactly, where an oracle excludes every law": share(
            exact(o) for o in outside if o.truth["separable"]["law"]
        ),
        "outside the catalogue given any name or set": share(
            any(c.said["names"] for c in o.claims) for o in outside
        ),
        "mistakes in the recording, told as such": share(o.mistake for o in outcomes if o.mixed_up),
        "mistakes told where the recording has none": share(
            o.mistake for o in outcomes if not o.mixed_up
        ),
        "crashes": share(o.crash for o in outcomes),
    }


def _sharp(outcomes: Sequence[Outcome]) -> Counts:
    """Count where one main effect with a name shows."""
    shown = [o for o in outcomes if o.main_shows]
    told = [o for o in shown if o.alarm]
    left = [o for o in shown if o.left > LEFT]

    def right(o: Outcome) -> bool:
        return o.main in o.found

    def sorted_out(o: Outcome) -> bool:
        return any(c.exactly or c.kind is True for c in o.here)

    def separable(what: str) -> list[Outcome]:
        return [o for o in shown if o.truth["separable"][what]]

    return {
        "sharp: right name at the right place": share(map(right, shown)),
        "sharp: right place, and right name or kind": share(map(sorted_out, shown)),
        "sharp: right place, and a name, set, family or kind that holds": share(
            any(c.name is True or c.kind is True for c in o.here) for o in shown
        ),
        "sharp: right place": share(bool(o.here) for o in shown),
        "sharp where the declared model leaves a misfit: right name and place": share(
            map(right, left)
        ),
        "sharp where the declared model leaves a misfit: right place": share(
            bool(o.here) for o in left
        ),
        "sharp where an oracle separates names: right name and place": share(
            map(right, separable("name"))
        ),
        "sharp where an oracle separates kinds: right place, and right name or kind": share(
            map(sorted_out, separable("kind"))
        ),
        "said to miss something": share(o.alarm for o in shown),
        "truth in the set of names, of those told": share(map(_name_held, told)),
        "truth in the set of places, of those told": share(map(_place_held, told)),
        "truth not excluded, names": share(map(_name_open, told)),
        "truth not excluded, places": share(
            not any(c.placed for c in o.claims) or _place_held(o) for o in told
        ),
    }


def _name_held(o: Outcome) -> bool:
    held = set[str]()
    for c in o.claims:
        if c.answer in NAMES:
            held |= c.said["names"]
        if c.answer == "family":
            held |= set(o.families.get(c.said["family"], ()))
        held |= c.said["also_names"]
    return bool(o.main_set("names") & held)


def _place_held(o: Outcome) -> bool:
    return any(o.main_set("places") & (c.said["places"] | c.said["also_places"]) for c in o.claims)


def _name_open(o: Outcome) -> bool:
    """Whether the answer holds the name or leaves it open: a kind its own names, unknown all."""
    told = [c for c in o.claims if c.answer != "unknown"]
    return not told or any(c.answer == "kind" and c.kind is True for c in told) or _name_held(o)


def _several(outcomes: Sequence[Outcome]) -> Counts:
    several = [
        o
        for o in outcomes
        if o.truth["several"] and all(e["moved"] > SHOWS for e in o.truth["effects"])
    ]
    return {
        "several effects that all show: all found": share(
            len(o.found) == len(o.truth["effects"]) for o in several
        ),
        "several effects that all show: strongest found": share(o.main in o.found for o in several),
        "several effects that all show: any found": share(bool(o.found) for o in several),
    }


def cells(outcomes: Sequence[Outcome]) -> dict[str, dict[str, int]]:
    """Count the words of the outcomes in every cell."""
    found: dict[str, dict[str, int]] = {}
    for o in outcomes:
        here = found.setdefault(str(o.truth["cell"]), {})
        here[o.word] = here.get(o.word, 0) + 1
    return found


def log_score(outcomes: Sequence[Outcome]) -> tuple[float, int]:
    """Return the mean logarithm of the probability given to what came true, and of how many names.

    Of every single name that states a probability; at a wrong place, and on controls, every name is
    wrong.
    """
    stated = [
        (float(c.said["probability"]), c.holds)
        for o in outcomes
        for c in o.claims
        if c.said["probability"] is not None and c.answer in ("exact", "approximate")
    ]
    logs = [math.log(min(max(p if ok else 1 - p, 1e-12), 1.0)) for p, ok in stated]
    return (sum(logs) / len(logs) if logs else math.nan), len(logs)


def interval(hits: int, total: int) -> tuple[float, float]:
    """Exact 95 % interval (Clopper and Pearson, Biometrika 26 (1934) 404), by bisection.

    Examples
    --------
    >>> [round(x, 4) for x in interval(1, 10)]
    [0.0025, 0.445]
    """
    if not total:
        return 0.0, 1.0
    k = np.arange(total + 1)
    logs = np.array([math.lgamma(total + 1) - math.lgamma(i + 1) - math.lgamma(total - i + 1)
                     for i in range(total + 1)])  # fmt: skip

    def at_most(n: int, p: float) -> float:
        return float(np.exp(logs + k * math.log(p) + (total - k) * math.log1p(-p))[: n + 1].sum())

    def solved(tail: Callable[[float], float]) -> float:
        """Where a tail that falls with p is 2.5 %."""
        low, high = 1e-15, 1 - 1e-15
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if tail(middle) > 0.025 else (low, middle)
        return 0.5 * (low + high)

    upper = 1.0 if hits == total else solved(lambda p: at_most(hits, p))
    lower = 0.0 if hits == 0 else 1.0 - solved(lambda q: 1.0 - at_most(hits - 1, 1.0 - q))
    return lower, upper


def predicted(outcomes: Sequence[Outcome], recordings: Path) -> list[float]:
    """Return the rms of predictions less readings over the noise, of answers that have some."""
    found = []
    for o in outcomes:
        made: Json = o.said.get("prediction") or {}
        if not made:
            continue
        path = recordings / f"{o.truth['id']}.csv"
        with path.open(encoding="utf-8") as file:
            names = [h.split(" [")[0] for h in file.readline().strip().split(",")]
            table = np.loadtxt(file, delimiter=",", ndmin=2)
        ratios = [
            np.mean((np.asarray(v, float) - table[:, names.index(k)]) ** 2)
            / o.truth["noise"][k] ** 2
            for k, v in made.items()
        ]
        found.append(float(np.sqrt(np.mean(ratios))))
    return found


def read_answers(path: Path) -> list[dict[str, Any]]:
    """Read a folder of JSON files, or one file with an answer a line."""
    if path.is_dir():
        return [json.loads(p.read_text(encoding="utf-8")) for p in sorted(path.glob("*.json"))]
    lines = path.read_text(encoding="utf-8").splitlines()
    return [json.loads(line) for line in lines if line.strip()]


def lines_of(outcomes: Sequence[Outcome]) -> list[str]:
    """Return the table."""
    lines = [f"{'recordings':76s}{len(outcomes)}"]
    for name, (hits, total) in count(outcomes).items():
        low, high = interval(hits, total)
        value = f"{100 * hits / total:.1f} % ({100 * low:.1f}-{100 * high:.1f})" if total else ""
        lines.append(f"{name:76s}{hits}/{total}  {value}".rstrip())
    score, names = log_score(outcomes)
    lines.append(f"{'log score of the stated probabilities':76s}{score:.3f} of {names} names")
    for cell, words in sorted(cells(outcomes).items()):
        ordered = sorted(words.items(), key=lambda pair: -pair[1])
        lines.append(f"{cell:13s} " + "  ".join(f"{word} {n}" for word, n in ordered))
    return lines


def main(words: Sequence[str] | None = None) -> int:
    """Print the score; 2 for what cannot be used, with one line that says why."""
    p = argparse.ArgumentParser(prog="scorer.py", description=__doc__)
    p.add_argument("truths", type=Path)
    p.add_argument("answers", type=Path)
    p.add_argument("--recordings", type=Path, default=None, help="CSV files, to judge predictions")
    options = p.parse_args(words)
    try:
        truths = json.loads(options.truths.read_text(encoding="utf-8"))
        outcomes = judge(truths, read_answers(options.answers))
        lines = lines_of(outcomes)
        missing = len(truths["recordings"]) - len(outcomes)
        if missing:
            lines.append(f"{'not answered':76s}{missing}")
        errors = predicted(outcomes, options.recordings) if options.recordings else []
    except (OSError, KeyError, TypeError, ValueError) as error:
        why = f"there is no {error}" if isinstance(error, KeyError) else str(error)
        print(f"scorer.py: {options.answers} beside {options.truths}: {why}", file=sys.stderr)
        return 2
    if errors:
        middle = float(np.median(errors))
        lines.append(f"{'prediction less reading over the noise, median':76s}{middle:.3g}")
    print("\n".join(lines))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
