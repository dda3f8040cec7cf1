"""The public recordings in words: where they are, how they are parted."""

from __future__ import annotations

from identification.datasets import (
    KNOWN,
    SETS,
    Protocol,
    available,
    protocol,
    public_set,
    set_available,
)
from identification.datasets.public_set import PublicSet


def listing() -> str:
    """All public recordings, one line each: first those `diagnose` takes, then the parted sets."""
    lines = ["recordings that diagnose takes by name:"]
    lines += [
        f"  {n:22s} {'here' if available(n) else 'absent':7s} {k.title}" for n, k in KNOWN.items()
    ]
    lines.append("data sets parted in training and test records:")
    states = {"folder": "here", "cache": "fetched", "": "absent"}
    for name, entry in SETS.items():
        lines.append(f"  {name:22s} {states[set_available(name)]:7s} {entry.title}")
    lines.append("bondsight recordings NAME tells more about a data set")
    return "\n".join(lines)


def details(name: str, found: Protocol | None = None) -> str:
    """Origin, licence, channels and parts of one data set."""
    entry = public_set(name)
    if found is None and set_available(name):
        found = protocol(name)
    lines = [
        f"{entry.name}: {entry.title}",
        f"source:   {entry.source}",
        f"citation: {entry.citation}",
        f"licence:  {entry.licence}",
        f"channels: {', '.join(entry.inputs) or 'none'} -> {', '.join(entry.outputs)}",
        f"protocol: {entry.official or 'own'}; {entry.init} samples may set the initial state",
        f"note:     {entry.note}",
    ]
    if found is None:
        group = " + ".join(entry.files[0][:3]) + (" + ..." if len(entry.files[0]) > 3 else "")
        where = f"the sub-folder {entry.folder} of $BONDSIGHT_RECORDINGS"
        return "\n".join([*lines, f"absent:   put {group} in {where}{_fetched(entry)}"])
    if entry.official and not found.official:
        lines.append("parts:    own, for the files here do not allow the published ones")
    for record in found.records:
        kind = record.name.removeprefix(f"{entry.name}/")
        lines.append(f"  {kind:32s} {record.n} samples at {record.fs:.6g} Hz from {record.source}")
    return "\n".join(lines)


def _fetched(entry: PublicSet) -> str:
    """Say how a set is downloaded, if its published files are read: only with a checksum."""
    if not entry.published:
        return ""
    unknown = [f"--sha256 {o.file}=HEX" for o in entry.published if o.sha256 is None]
    run = " ".join([f"bondsight recordings {entry.name} --fetch", *unknown[:2]])
    more = " ..." if len(unknown) > 2 else ""
    why = "; its checksum is not known here, take it from whom you trust" if unknown else ""
    return f", or run {run}{more}{why}"
