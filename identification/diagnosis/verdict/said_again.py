"""A verdict of a file in plain words: `bondsight explain`."""

from __future__ import annotations

import re
import textwrap
import unicodedata
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from bondgraph.support.errors import BondsightError
from identification.diagnosis.catalogue import by_name
from identification.diagnosis.catalogue.words import spoken
from identification.diagnosis.evidence.kinds_told import EXACT
from identification.diagnosis.explanation.advice import INCOMPLETE
from identification.diagnosis.explanation.undetermined import UNDETERMINED
from identification.diagnosis.localisation.recording.region import multiple
from identification.diagnosis.screening.flexible_forms import SORTS, sort_anywhere
from identification.diagnosis.verdict.lines import sure_words
from identification.diagnosis.verdict.retraced import traces, tried
from identification.estimation.leaning import leaning_words
from identification.report.words import ended, gathered, listed, shortened, spaced

Data = Mapping[str, Any]
WIDTH = 96
AT_FLOOR = 1.25
MOST = 6
ANY_TWO = "transformer"
"""What a verdict calls every two-port."""
NO_LAW = "no law of the catalogue fits it"
ALMOST = 0.99
"""Share of the misfit from which it is told how near to all it is."""
UNPROVED = ", but does not predict held-out samples well enough to be named"

_ANSWERS = {
    "explained": (
        "Nothing is missing: the model {model} describes {recording} as far as the noise of the "
        "recording allows."
    ),
    "parameters_only": (
        "No physics is missing: the structure of {model} is right for {recording}, only its "
        "declared parameter values were off."
    ),
    "missing_physics": "{model} leaves out {count} that {recording} shows: {names}.",
    "unknown_physics": (
        "Something is missing in {model} that {recording} shows, but these data do not "
        "support one name for it."
    ),
    "insufficient_data": "{recording} is too little to judge {model} by.",
}


def retold(v: Data) -> str:
    """Say a verdict (as `read_verdict` returns it) again in plain words.

    Control characters of the file never reach the terminal.
    """
    v = _clean(v)
    # of a recording that looks wrong itself nothing was found
    findings = [] if _not_searched(v) else v["findings"]
    parts = [
        _paragraph("What was found", [_answer(v), *(_meaning(f) for f in findings)]),
        _paragraph("Where", [*(_place(f) for f in findings), *(_elsewhere(v) if findings else ())]),
        _paragraph("What in the recording led there", traces(v) if findings else ()),
        _paragraph("What was tried, and how far behind it was", tried(v)),
        _paragraph("How sure", [_certainty(f, _rest(v)) for f in findings] or _silence(v)),
        _paragraph("How much better, on samples that no parameter was fitted to", _gains(v)),
        _paragraph("What remains", _left(v)),
        _paragraph("What else is possible", [t for f in findings for t in _rivals(f)]),
        _paragraph("What it rests on", _basis(v)),
        _paragraph("What was noticed on the way", gathered(v.get("notes", ()))),
        _paragraph("What to do next", list(map(spoken, v["advice"])) or [_nothing_to_do(v)]),
    ]
    return "\n\n".join(p for p in parts if p)


def _clean(value: Any) -> Any:
    """Return the same data with control and format characters taken out of every text."""
    if isinstance(value, str):
        kept = (" " if unicodedata.category(c) in ("Cc", "Zl", "Zp") else c for c in value)
        return "".join(c for c in kept if unicodedata.category(c) not in ("Cf", "Cs", "Co"))
    if isinstance(value, list):
        return [_clean(x) for x in value]
    if isinstance(value, dict):
        return {str(_clean(k)): _clean(x) for k, x in value.items()}
    return value


def _paragraph(title: str, sentences: Iterable[str]) -> str:
    lines = [s for s in dict.fromkeys(sentences) if s]
    if not lines:
        return ""
    body = [textwrap.fill(s, WIDTH, initial_indent="  ", subsequent_indent="  ") for s in lines]
    return "\n".join([title, *body])


def _answer(v: Data) -> str:
    if _not_searched(v):
        return (
            f"The recording {shortened(v['recording']['name'])} rather than "
            f"the model {v['model']} looks wrong: {' or '.join(v['suspects'])}. No physics "
            "is told before that is mended."
        )
    return " ".join((_found(v), *(ended(f"But {s}") for s in v.get("suspects", ()))))


def _not_searched(v: Data) -> bool:
    """Whether the recording looks so wrong that no physics is told."""
    return bool(v.get("suspects")) and not v.get("parameters")


def _found(v: Data) -> str:
    named = [f"{_effect(f)} at {f['location']['element']}" for f in v["findings"]]
    count = {1: "one effect", 2: "two effects", 3: "three effects"}.get(len(named))
    return _ANSWERS[v["verdict"]].format(
        model=v["model"] or "the model",
        recording=shortened(v["recording"]["name"]) or "the recording",
        count=count or f"{len(named)} effects", names=listed(named),
    )  # fmt: skip


def _effect(f: Data) -> str:
    if f["effect"] == "unknown" and f.get("answer") == "family":
        return f"one of {listed(_members(f))}"
    return "an unnamed effect" if f["effect"] == "unknown" else spaced(f["effect"])


def _members(f: Data) -> list[str]:
    """Return the effects of a family among which the data do not choose."""
    known = (p["effect"] for p in f["also_possible"])
    return [spaced(n) for n in dict.fromkeys(known) if n != "unknown"]


def _meaning(f: Data) -> str:
    """Sentence of the catalogue about the effect."""
    if f["effect"] == "unknown":
        family = f["family"]
        if family in ("", "outside", "unknown"):
            return ""
        return f"Whatever it is, all that comes close belongs to one family: {spaced(family)}."
    try:
        effect = by_name(f["effect"])
    except (BondsightError, KeyError):
        return ""
    law = f" Its fitted law: {spaced(f['law'])}." if f["law"] not in (effect.law, "none") else ""
    formula = f" In symbols: {f['formula']}." if f.get("formula") else ""
    named = [f"{p['name']} is: {p['meaning']}" for p in f["parameters"][:MOST] if p.get("meaning")]
    formula += f" There {'; '.join(named)}." if formula and named else ""
    return f"{_effect(f).capitalize()}: {f.get('sentence') or effect.sentence}.{law}{formula}"


def _place(f: Data) -> str:
    place = f["location"]
    if not place["element"]:
        return "The place is open: no element of the model explains the misfit better than others."
    # the file has one word for both
    word = "transformer or gyrator" if place["kind"] == ANY_TWO else place["kind"]
    kind = f"the {word} " if word else ""
    family = f.get("answer") == "family"
    what = "It" if family else f"The {_effect(f).removeprefix('an ')}"
    verb = "is closest to" if f["effect"] == "unknown" and not family else "sits at"
    text = f"{what} {verb} {kind}{place['element']}."
    others = place["indistinguishable_from"]
    if others:
        text += (
            f" With these sensors {listed(others)} cannot be told apart from it: take them as "
            "one group."
        )
    return text


def _elsewhere(v: Data) -> Iterator[str]:
    """Yield what became of every class of places that the readings were asked about."""
    found = [p for p in v.get("places", ()) if p["elements"]]
    if found:
        yield "What became of the places:"
    yield from (f"- {listed(p['elements'])}: {p['why']}" for p in found)


def _rest(v: Data) -> float:
    """Return the times of the noise that a repair leaves where that is more than noise, else 0."""
    if not any(a.startswith(INCOMPLETE) for a in v["advice"]):
        return 0.0
    return max((r["over_noise"] or 0.0 for r in v.get("remaining", {}).values()), default=0.0)


TRIED = "what the best of all that was tried explains of the misfit"
"""What a share is one of where more than noise is left."""


def _certainty(f: Data, rest: float = 0.0) -> str:
    if f.get("answer") == "kind" and f.get("kind"):
        fit = f.get("law_fit")
        near, close = fit is not None and fit >= EXACT, f["also_possible"]
        law = ""
        if close and fit is not None:
            law = (
                f" The law that comes closest, {_trial(close[0])}, explains {_percent(fit)} of "
                f"what can be explained so{UNPROVED if near else ''}."
            )
        return (
            f"It is {f.get('kind_words') or _sort(f['kind'])}{'' if near else f'; {NO_LAW}'}.{law}"
        )
    share = f["share_of_misfit_explained"]
    part = much(share, 1, f.get("answer") == "exact") if share > ALMOST else _percent(share)
    # the share is one of what the best of all that was tried explains
    explained = f"it accounts for {part} of {TRIED if rest else 'the misfit above the noise floor'}"
    if f["effect"] == "unknown":
        close = [p for p in f["also_possible"] if not p.get("kind")]
        if f.get("answer") == "family":
            return (
                f"Which of {listed(_members(f))} it is these data do not tell; "
                f"{sure_words('family', f['confidence'], rest)}."
            )
        if not close or share <= 0:
            if f.get("nearest"):
                return f"No name is given. What comes nearest: {coming_near(f['nearest'])}."
            return "Nothing in the catalogue comes near; no name is given."
        return (
            f"No name is given. The best description, {_trial(close[0])}, accounts for "
            f"{_percent(share)} of {TRIED}."
        )
    fit = f.get("law_fit")
    law = "" if fit is None else f"; its law explains {_percent(fit)} of what its kind could there"
    chance = (
        sure_words(f.get("answer", ""), f["confidence"], rest) if f["confidence"] > 0
        else "not tried again beside what was named after it, so no probability is given"
    )  # fmt: skip
    return f"{_effect(f).capitalize()}: {chance}; {explained}{law}."


def _sort(kind: str) -> str:
    return SORTS.get(kind, f"something {kind}")


def much(share: float, digits: int, noise: bool) -> str:
    """Return a share that is all only where nothing but noise is left."""
    most = 100.0 - 10.0**-digits
    if 100 * share < 0.5 * (100.0 + most):
        return f"{100 * share:.{digits}f} %"
    return "all" if noise else f"{most:.{digits}f} %"


def coming_near(found: Iterable[Data]) -> str:
    """Say what removes most of a misfit without being told, from a finding's ``nearest``.

    Examples
    --------
    >>> coming_near([{"effect": "low_pass", "element": "u", "kind": "", "share": 0.41}])
    'low pass at u (41 % of the misfit)'
    """
    return listed([f"{_trial(n)} ({_percent(n['share'])} of the misfit)" for n in found])


def _silence(v: Data) -> list[str]:
    if _not_searched(v):
        return [
            "With that undone the model explains nearly all that it had missed, or its values come "
            "back to those declared."
        ]
    if v["verdict"] == "insufficient_data":
        return ["No statement is made: these data do not bear one."]
    return [
        "What these data do not excite they cannot show: this says that nothing was visible here, "
        "not that nothing exists."
    ]


def _gains(v: Data) -> list[str]:
    fit = v["fit"]
    before, after = fit["nominal"]["test_rmse"], fit["repaired"]["test_rmse"]
    lines = []
    for n, old in before.items():
        floor, best = fit["noise_floor"].get(n), after.get(n, old)
        unit = v.get("units", {}).get(n, "")
        unit = f" {unit}" if unit not in ("", "1") else ""
        text = f"{n}: error {old:.3g}{unit}"
        if n in after:
            text += f" before, {best:.3g}{unit} after the repair{_ratio(old, best)}"
        if floor:
            text += f"; the noise of the recording is {floor:.3g}{unit}"
            rest = v.get("remaining", {}).get(n, {}).get("over_noise") or 0.0
            text += f"; what is left is {rest:.3g} times the noise there" if rest else ""
            at_floor = best < AT_FLOOR * floor and rest < AT_FLOOR
            text += ", so nothing is left to gain" if at_floor else ""
        lines.append(f"{text} (rms{'' if unit else ', SI units'}).")
    return lines


def _ratio(old: float, new: float) -> str:
    if not new > 0 or not old > 0:
        return ""
    ratio = old / new
    if ratio > 1.02:
        return f", {multiple(ratio)} smaller"
    return ", no better" if ratio > 0.98 else ", larger: do not use the repair blindly"


def _left(v: Data) -> list[str]:
    """Say of every reading whose rest has a place or regions what it is."""
    lines = []
    for n, r in v.get("remaining", {}).items():
        place, kind, regions = r.get("place", []), r.get("kind", ""), r.get("regions", [])
        if not (place or regions) or r["over_noise"] is None:
            continue
        at = f", at {listed(place)}" if place else ""
        # the file does not say in which domain it is
        like = f", like {sort_anywhere(kind)}" if kind else ""
        where = f"; above all {_apart(regions[0], n)}" if regions else ""
        lines.append(f"{n}: {r['over_noise']:.3g} times the noise{at}{like}{where}.")
    return lines


def _apart(region: str, name: str) -> str:
    """Put the place of a region's sentence before a colon: another sentence leads up to it.

    Examples
    --------
    >>> _apart("from 2 to 34 Hz the misfit of i is 20 times its noise there", "i")
    'from 2 to 34 Hz: there the misfit is 20 times its noise'
    """
    said = rf" the misfit(?: of {re.escape(name)})? is "
    moved = re.sub(said, ": there the misfit is ", region, count=1)
    return moved.replace(" noise there", " noise", 1) if moved != region else region


def _rivals(f: Data) -> list[str]:
    possible = f["also_possible"]
    if not possible:
        return []
    # where kinds remain, the closest law is none of them: how far off it is was said above
    possible = [p for p in possible if p.get("kind")] or possible
    head = (
        "Instead of a name, these remain"
        if f["effect"] == "unknown"
        else (f"Besides {_effect(f)} at {f['location']['element']} these are not excluded")
    )
    listed = [f"{_trial(p)} ({p['evidence']})" if p["evidence"] else _trial(p) for p in possible]
    return [f"{head}: {'; '.join(listed)}."]


def _trial(p: Data) -> str:
    what = "a curve without a name" if p["effect"] == "unknown" else spaced(p["effect"])
    what = (p.get("kind_words") or _sort(p["kind"])) if p.get("kind") else what
    return f"{what} at {p['element']}"


def _basis(v: Data) -> list[str]:
    r = v["recording"]
    lines = [
        f"{r['samples']} samples of {listed(r['channels']) or 'no channel'} in "
        f"{shortened(r['name']) or 'the recording'}, SHA-256 {_hashes(r)}; "
        f"{v['seconds']:.1f} s, seed {v['seed']}."
    ]
    for f in v["findings"]:
        if known := [_value(p) for p in f["parameters"]]:
            lines.append(f"Fitted for {_effect(f)}: {_few(known)}.")
        chosen = [_value({"ci95": (None, None), **p}) for p in f.get("constants", ())]
        if chosen:
            lines.append(f"Of its law, not fitted: {_few(chosen)}.")
    if v["verdict"] == "unknown_physics" and (bent := list(map(_value, v.get("parameters", ())))):
        lines.append(f"Fitted to the model as it is, bent by what is missing: {_few(bent)}.")
    lines += [f"The recording tells {t['words']}." for t in v.get("together", ())]
    leaning = (leaning_words(n["words"]) for n in v["nuisances"] if n.get("words"))
    lines += [f"{said.replace('the fit', 'The fit', 1)}." for said in leaning]
    beyond = [n["name"] for n in v["nuisances"] if not n["within_bounds"]]
    if beyond:
        lines.append(
            f"Fitted beside the parameters, and at the end of what it may be: {listed(beyond)}. "
            "Look at it."
        )
    return lines


def _few(values: list[str]) -> str:
    more = f"; {len(values) - MOST} more in the file" if len(values) > MOST else ""
    return "; ".join(values[:MOST]) + more


def _hashes(r: Data) -> str:
    """Beginning of the hash, that of each file where there are several."""
    files = dict.fromkeys(part["sha256"] for part in r.get("parts") or [r])
    return " + ".join(hashed[:12] or "not from a file" for hashed in files)


def _value(p: Data) -> str:
    said = f", {p['meaning']}" if p.get("meaning") else ""
    if p["value"] is None or p.get("remark") == UNDETERMINED:
        return f"{p['name']} {UNDETERMINED}{said}"
    low, high = p["ci95"]
    unit = f" {p['unit']}" if p["unit"] not in ("", "1") else ""
    known = f" ({p['remark']})" if p.get("remark") else ""
    if low is not None and high is not None:
        known = f" (95 %: {low:.6g} to {high:.6g}{unit})"
    return f"{p['name']} = {p['value']:.4g}{unit}{known}{said}"


def _nothing_to_do(v: Data) -> str:
    if v.get("suspects"):  # of a file that was written before its advice said so
        return "Mend the file first, then diagnose it again: the values follow after that."
    # that a repair leaves more than noise stands among the advice: whoever diagnosed has judged it
    return {
        "explained": "Use the model as it is, within the range that was recorded.",
        "parameters_only": "Use the model with the fitted parameters.",
        "missing_physics": (
            "Use the repaired model; check it on a recording of another amplitude before relying "
            "on it there."
        ),
        "unknown_physics": "Record more: another amplitude, another speed, a rest after a step.",
        "insufficient_data": "Record longer, with the system excited.",
    }[v["verdict"]]


def _percent(share: float) -> str:
    return f"{100 * share:.3g} %"
