"""Fits as one open file: model, recordings, options, values and simulations, reopened bit by bit.

The container is that of `bondgraph.support.archive`: NumPy arrays and one JSON document, no pickle.
The model stands in it as the JSON of `bondgraph.export.graph_json.write_graph`, which stores every
law and operator of this project; a law of your own needs its form, see `laws`.
"""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, replace
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from bondgraph.export.graph_json.read_graph import from_json
from bondgraph.export.graph_json.write_graph import to_json
from bondgraph.laws import Law
from bondgraph.signals.recording import Recording, Split
from bondgraph.support.archive import read_archive, software, write_archive
from bondgraph.support.arrays import Array
from bondgraph.support.errors import BondsightError, UnusableInput
from bondgraph.support.spelled import spelled
from identification.estimation.estimates import Estimate
from identification.estimation.filtered import Filtered
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.result import Estimation
from identification.study.calibration import Known
from identification.study.joint import JointPoint
from identification.study.priors import LogNormal, Normal, Prior
from identification.study.specification import Nuisances, Vary
from identification.study.study import SettledSetting, Study

SCHEMA = "bondsight-fit/1"
"""Name and version of the document."""
_PRIORS: Mapping[str, Callable[..., Prior]] = {"normal": Normal, "log-normal": LogNormal}
_OPTIONS = ("initial", "hold", "noise", "init", "silent", "window", "n_sub", "process_noise")
ARRAYS = (np.ndarray, np.generic)
_FILTERED = ("reading", "innovation", "state", "deviation")


@spelled
def save_fit(
    estimation: Estimation,
    path: str | Path,
    *,
    embed: bool = True,
    command: str = "",
    laws: Iterable[type[Law]] = (),
) -> str:
    """Write an estimation to one file, all or nothing.

    Parameters
    ----------
    estimation : Estimation
    path : path
        File to write, ending in `.npz`; an existing one is replaced at once at the end.
    embed : bool
        Store the recordings too. Otherwise only what identifies them: `open_fit` then asks for
        them and checks every bit.
    command : str
        What made the fit, for the reader of the file.
    laws : iterable of type of Law, optional
        Laws of the model beside those of `bondgraph.laws`.

    Returns
    -------
    str
        SHA-256 of the content.

    Raises
    ------
    UnusableInput
        Another ending, a model that has no JSON form, or a file that cannot be written.

    Examples
    --------
    >>> len(save_fit(fit, folder / "fit.npz"))  # its SHA-256
    64
    """
    target = Path(path)
    if target.suffix.lower() != ".npz":
        raise UnusableInput(f"{target.name}: a fit is saved as .npz; name it so")
    study = estimation.study
    arrays: dict[str, Array] = {}
    entries = [_put_recording(r, i, embed, arrays) for i, r in enumerate(study.records)]
    document = {
        "made": provenance(command),
        "graph": to_json(study.graph, laws=laws),
        "recordings": entries,
        "study": _put_study(study),
        "fit": _put_fit(estimation, arrays),
    }
    return write_archive(target, SCHEMA, document, arrays)


def provenance(command: str = "") -> dict[str, str]:
    """Return who computed, with what and when."""
    return {
        "software": software(),
        "python": platform.python_version(),
        **{name: version(name) for name in ("numpy", "scipy", "casadi")},
        "saved": datetime.now(UTC).isoformat(timespec="seconds"),
        "command": command,
    }


@spelled
def open_fit(
    path: str | Path,
    recordings: Recording | Sequence[Recording] = (),
    *,
    laws: Iterable[type[Law]] = (),
) -> Estimation:
    """Reopen what `save_fit` wrote: the same values, simulations and text, ready to go on fitting.

    Parameters
    ----------
    recordings : Recording or sequence of Recording
        Those that the file only names; their values must be the same bit by bit.
    laws : iterable of type of Law, optional
        As given to `save_fit`.

    Raises
    ------
    UnusableInput
        One line: no such file, damaged, another version, or a recording that is missing or
        differs.

    Examples
    --------
    >>> from bondsight import save_fit
    >>> _ = save_fit(fit, folder / "kept.npz")
    >>> open_fit(folder / "kept.npz").values == fit.values
    True
    """
    file = Path(path)
    document, arrays = read_archive(file, SCHEMA)
    given = (recordings,) if isinstance(recordings, Recording) else tuple(recordings)
    try:
        graph = from_json(document["graph"], laws=laws)
        records = [
            _take_recording(e, i, arrays, given, file.name)
            for i, e in enumerate(document["recordings"])
        ]
        form = dict(document["study"])
        fitted = int(form["fitted"])
        study = Study(
            graph,
            records[:fitted],
            [_take_vary(v) for v in form["free"]],
            form["fixed"],
            nuisances=_get_nuisances(form["nuisances"]),
            splits=[_take_split(s) for s in form["splits"]],
            validation=records[fitted:],
            **{k: form[k] for k in _OPTIONS if k in form},
        )
        return _take_fit(document["fit"], study, arrays)
    except BondsightError:
        raise
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise UnusableInput(
            f"{file.name}: cannot be reopened, its content is not that of a fit ({error}); "
            "save it again"
        ) from error


def _digest(r: Recording) -> str:
    """SHA-256 of times, names, units and values."""
    found = hashlib.sha256(np.ascontiguousarray(r.time).tobytes())
    for name, values in r.channels.items():
        found.update(f"{name} [{r.units[name]}]".encode())
        found.update(np.ascontiguousarray(values).tobytes())
    return found.hexdigest()


def _put_recording(r: Recording, i: int, embed: bool, arrays: dict[str, Array]) -> dict[str, Any]:
    entry = {
        "name": r.name, "units": dict(r.units), "source": r.source, "sha256": r.sha256,
        "meta": dict(r.meta), "content": _digest(r), "embedded": embed,
    }  # fmt: skip
    if embed:
        arrays[f"recordings/{i}/time"] = np.asarray(r.time)
        arrays |= {f"recordings/{i}/channel/{n}": np.asarray(v) for n, v in r.channels.items()}
    return entry


def _take_recording(
    e: Mapping[str, Any],
    i: int,
    arrays: Mapping[str, Array],
    given: Sequence[Recording],
    where: str,
) -> Recording:
    named = {k: e[k] for k in ("name", "source", "sha256", "meta")}
    if e["embedded"]:
        channels = {n: arrays[f"recordings/{i}/channel/{n}"] for n in e["units"]}
        time = arrays[f"recordings/{i}/time"]
        found = Recording(time=time, channels=channels, units=e["units"], **named)
        if _digest(found) != e["content"]:
            raise UnusableInput(f"{where}: recording {e['name']!r} does not match its checksum")
        return found
    for r in given:
        if _digest(r) == e["content"]:
            return replace(r, **named)
    origin = f" (read from {e['source']})" if e["source"] else ""
    same = [r.name for r in given if r.name == e["name"]]
    why = "the one given differs from it" if same else "give it as recordings=..."
    raise UnusableInput(f"{where} holds no samples of recording {e['name']!r}{origin}; {why}")


def _put_study(study: Study) -> dict[str, Any]:
    return {
        "free": [_put_vary(v) for v in study.free],
        "fixed": dict(study.fixed),
        "nuisances": asdict(study.nuisances),
        "splits": [_put_split(s) for s in study.splits],
        "fitted": len(study.recordings),
        **{k: _plain(getattr(study, k)) for k in _OPTIONS},
    }  # fmt: skip


def _plain(value: Any) -> Any:
    """Return mappings as dictionaries, and arrays in them as lists."""
    if not isinstance(value, Mapping):
        return value
    return {n: np.asarray(v).tolist() if isinstance(v, ARRAYS) else v for n, v in value.items()}


def _put_vary(v: Vary) -> dict[str, Any]:
    kind = next((k for k, cls in _PRIORS.items() if type(v.prior) is cls), None)
    if v.prior is not None and kind is None:
        raise UnusableInput(f"a prior of class {type(v.prior).__name__} has no form in a file")
    plain = asdict(v)
    return plain if kind is None else {**plain, "prior": {"kind": kind, **plain["prior"]}}


def _take_vary(form: Mapping[str, Any]) -> Vary:
    prior = dict(form["prior"] or {})
    made = _PRIORS[prior.pop("kind")](**prior) if prior else None
    return Vary(**{**form, "prior": made})


def _put_split(s: Split) -> dict[str, Any]:
    parts = {
        k: None if (p := getattr(s, k)) is None else (p.start, p.stop, p.step)
        for k in ("train", "test", "rest")
    }
    return {**parts, "rule": s.rule, "score_from": s.score_from}


def _take_split(form: Mapping[str, Any]) -> Split:
    train, test = slice(*form["train"]), slice(*form["test"])
    rest = None if form["rest"] is None else slice(*form["rest"])
    return Split(train, test, form["rule"], rest, form["score_from"])


def _put_fit(f: Estimation, arrays: dict[str, Array]) -> dict[str, Any]:
    arrays["theta"], arrays["covariance"] = f.point.theta, np.asarray(f.covariance)
    arrays["trace"] = np.array(f.trace, float)
    lists = {"states": f.point.states, "simulated": f.simulated, "floors": f.setting.floors}
    for name, values in lists.items():
        arrays |= {f"{name}/{i}": np.asarray(v) for i, v in enumerate(values)}
    arrays |= {f"correction/{i}": c for i, c in enumerate(f.setting.corrections) if c is not None}
    if f.setting.corrected_at is not None:
        arrays["corrected_at"] = f.setting.corrected_at
    for i, polynomials in enumerate(f.setting.whitening):
        arrays |= {f"whitening/{i}/{c}": np.asarray(v) for c, v in enumerate(polynomials)}
    return {
        "method": f.method, "optimiser": f.optimiser, "status": f.status.name,
        "cost": f.cost, "notes": list(f.notes), "seconds": f.seconds,
        "hold": f.setting.hold, "n_sub": list(f.setting.n_sub),
        "n_fine": list(f.setting.n_fine),
        "corrected": [c is not None for c in f.setting.corrections],
        "whitening": [len(w) for w in f.setting.whitening],
        "counts": {k: len(v) for k, v in lists.items()},
        "estimates": [_put_estimate(e) for e in f.estimates],
        "nuisances": [_put_estimate(e) for e in f.nuisances],
        "filtered": _put_filtered(f.filtered, arrays),
        "run": f.run,
    }  # fmt: skip


def _put_filtered(f: Filtered | None, arrays: dict[str, Array]) -> dict[str, Any] | None:
    if f is None:
        return None
    for name in _FILTERED:
        arrays |= {f"filtered/{name}/{i}": v for i, v in enumerate(getattr(f, name))}
    noises = [_put_estimate(e) for e in f.noises]
    return {"log_likelihood": f.log_likelihood, "noises": noises, "count": len(f.reading)}


def _take_filtered(form: Mapping[str, Any] | None, arrays: Mapping[str, Array]) -> Filtered | None:
    if form is None:
        return None
    parts = (
        tuple(arrays[at] for i in range(form["count"]) if (at := f"filtered/{name}/{i}") in arrays)
        for name in _FILTERED
    )
    noises = tuple(Estimate(**e) for e in form["noises"])
    return Filtered(form["log_likelihood"], noises, *parts)


def _get_nuisances(form: Mapping[str, Any]) -> Nuisances:
    gains = {n: Known(**g) for n, g in form.get("gains", {}).items()}
    return Nuisances(**{**form, "gains": gains})


def _put_estimate(e: Estimate) -> dict[str, Any]:
    return {**asdict(e), "ci95": tuple(map(float, e.ci95)), "at_bound": bool(e.at_bound)}


def _take_fit(form: Mapping[str, Any], study: Study, arrays: Mapping[str, Array]) -> Estimation:
    def several(name: str) -> tuple[Array, ...]:
        return tuple(arrays[f"{name}/{i}"] for i in range(form["counts"][name]))

    whitening = tuple(
        tuple(arrays[f"whitening/{i}/{c}"] for c in range(n))
        for i, n in enumerate(form["whitening"])
    )
    return Estimation(
        study=study,
        setting=SettledSetting(
            form["hold"],
            tuple(form["n_sub"]),
            several("floors"),
            whitening,
            tuple(form["n_fine"]),
            tuple(
                arrays[f"correction/{i}"] if there else None
                for i, there in enumerate(form["corrected"])
            ),
            arrays.get("corrected_at"),
        ),
        method=form["method"],
        optimiser=form["optimiser"],
        status=FitStatus[form["status"]],
        point=JointPoint(arrays["theta"], several("states")),
        covariance=arrays["covariance"],
        cost=form["cost"],
        trace=tuple(map(float, arrays["trace"])),
        estimates=tuple(Estimate(**e) for e in form["estimates"]),
        nuisances=tuple(Estimate(**e) for e in form["nuisances"]),
        simulated=several("simulated"),
        notes=tuple(form["notes"]),
        seconds=form["seconds"],
        filtered=_take_filtered(form.get("filtered"), arrays),
        run=form.get("run", ""),
    )
