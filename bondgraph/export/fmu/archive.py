"""Compiling the sources and packing the archive; equal contents give equal bytes."""

from __future__ import annotations

import subprocess
import tempfile
import zipfile
from collections.abc import Mapping
from pathlib import Path

from bondgraph.support.errors import BondsightError
from bondgraph.support.native import compiler
from bondgraph.support.whole_file import replacing

# no -march=native: the binary travels; no debugging data and no build id: it stays the same
FLAGS = (
    "-std=c99", "-O2", "-fPIC", "-shared", "-s", "-fvisibility=hidden",
    "-Wl,--build-id=none", "-ffp-contract=off",
)  # fmt: skip


def linux_binary(sources: Mapping[str, bytes], main: str) -> bytes | None:
    """Compile `main` among `sources` to a shared library for Linux on x86-64.

    Returns
    -------
    bytes or None
        None if there is no gcc for that machine.

    Raises
    ------
    BondsightError
        If gcc refuses the sources; shows its first error.
    """
    gcc = compiler()
    if gcc is None or not _makes_linux64(gcc):
        return None
    with tempfile.TemporaryDirectory() as folder:
        for name, text in sources.items():
            (Path(folder) / name).write_bytes(text)
        done = subprocess.run(
            [gcc, *FLAGS, main, "-o", "unit.so", "-lm"],
            cwd=folder,
            capture_output=True,
            text=True,
            timeout=600,
            check=False,
        )
        if done.returncode:
            first = next((s for s in done.stderr.splitlines() if "error" in s), done.stderr[:200])
            raise BondsightError(f"gcc cannot compile the unit: {first}")
        return (Path(folder) / "unit.so").read_bytes()


def _makes_linux64(gcc: str) -> bool:
    asked = subprocess.run(
        [gcc, "-dumpmachine"], capture_output=True, text=True, timeout=60, check=False
    )
    machine = asked.stdout.strip()
    return machine.startswith("x86_64") and "linux" in machine and "x32" not in machine


def write_archive(path: Path, files: Mapping[str, bytes]) -> None:
    """Write `files` as a zip archive without dates, in the order of their names, whole or not.

    Raises
    ------
    UnusableInput
        If `path` cannot be written.
    """
    with replacing(path) as stream, zipfile.ZipFile(stream, "w") as archive:
        for name in sorted(files):
            entry = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.create_system = 3
            entry.external_attr = (0o755 if name.endswith(".so") else 0o644) << 16
            archive.writestr(entry, files[name], compresslevel=9)
