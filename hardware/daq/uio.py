"""Registers of a real card on Linux: by its UIO driver, or by the resource files of PCI.

The kernel's ``uio_mf624`` serves the MF624 only and maps its BARs 0, 2 and 4 in this order. For an
MF634 the kernel maps nothing; its BARs are reached as ``resourceN`` in sysfs, which needs root (or
a udev rule) and no other driver (comedi) on the card.
"""

from __future__ import annotations

import mmap
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import final

from hardware.daq.mapped import MappedRegisters
from hardware.errors import DriverMissing, LinkLost

__all__ = ["PciRegisters", "UioRegisters"]

HUMUSOFT = 0x186C
_PAGE = mmap.PAGESIZE


def _number(path: Path) -> int | None:
    try:
        return int(path.read_text().strip(), 0)
    except (OSError, ValueError):
        return None


def _matching(folders: Iterator[Path], inner: str, device: int) -> list[Path]:
    """Folders whose PCI identity is that of the card."""
    return sorted(
        f
        for f in folders
        if _number(f / inner / "vendor") == HUMUSOFT and _number(f / inner / "device") == device
    )


def _choose(found: list[Path], index: int, missing: str) -> Path:
    if index >= len(found):
        raise DriverMissing(missing)
    return found[index]


class _OpenedRegisters(MappedRegisters):
    """Registers in mapped files."""

    def __init__(self, maps: Mapping[int, tuple[mmap.mmap, int, int]], address: str) -> None:
        self._maps = [m for m, _, _ in maps.values()]
        super().__init__({b: memoryview(m)[o : o + n] for b, (m, o, n) in maps.items()}, address)

    def close(self) -> None:
        """Let go of the memory and of the files."""
        super().close()
        for mapped in self._maps:
            try:
                mapped.close()
            except BufferError:
                # compiled code may still hold a pointer; the process's end unmaps it
                continue
        self._maps = []


def _map(path: Path, length: int, offset: int) -> mmap.mmap:
    try:
        file = os.open(path, os.O_RDWR | os.O_SYNC)
    except OSError as error:
        raise DriverMissing(
            f"{path}: cannot be opened ({error.strerror}); give the user access to it by a udev "
            "rule, or run as root"
        ) from error
    try:
        return mmap.mmap(file, length, mmap.MAP_SHARED, offset=offset)
    except (OSError, ValueError) as error:
        raise LinkLost(f"{path}: its memory cannot be mapped ({error}); is the card alive?") from (
            error
        )
    finally:
        os.close(file)


@final
class UioRegisters(_OpenedRegisters):
    """Registers by ``/dev/uioN``.

    Parameters
    ----------
    device : int
        PCI device number: 0x0624, 0x0634.
    bars : sequence of int
        BAR of every map of the driver, in its order.
    index : int
        Which card, if there are several.
    root : Path
        Where ``sys`` and ``dev`` are; another one for tests.

    Raises
    ------
    DriverMissing
        No such card has a UIO driver, or its node cannot be opened.
    """

    def __init__(
        self,
        device: int = 0x0624,
        bars: tuple[int, ...] = (0, 2, 4),
        index: int = 0,
        root: Path = Path("/"),
    ) -> None:
        found = _matching((root / "sys/class/uio").glob("uio*"), "device", device)
        folder = _choose(
            found,
            index,
            f"no UIO device for PCI {HUMUSOFT:04x}:{device:04x} (number {index}); load the "
            "driver (modprobe uio_mf624), or use the resource files of PCI",
        )
        node = root / "dev" / folder.name
        maps = {}
        for n, bar in enumerate(bars):
            size = _number(folder / f"maps/map{n}/size")
            if size is None:
                raise DriverMissing(f"{node}: its driver has no map {n}; expected {len(bars)}")
            inner = _number(folder / f"maps/map{n}/offset") or 0
            whole = -(-(inner + size) // _PAGE) * _PAGE
            maps[bar] = (_map(node, whole, n * _PAGE), inner, size)
        super().__init__(maps, str(node))


@final
class PciRegisters(_OpenedRegisters):
    """Registers by ``/sys/bus/pci/devices/*/resourceN``.

    Parameters
    ----------
    device : int
        PCI device number: 0x0624, 0x0634.
    bars : sequence of int
        BARs to map.
    index : int
        Which card, if there are several.
    root : Path
        Where ``sys`` is; another one for tests.

    Raises
    ------
    DriverMissing
        No such card, or its files cannot be opened.
    """

    def __init__(
        self,
        device: int = 0x0634,
        bars: tuple[int, ...] = (0, 2, 3),
        index: int = 0,
        root: Path = Path("/"),
    ) -> None:
        found = _matching((root / "sys/bus/pci/devices").glob("*"), ".", device)
        folder = _choose(
            found, index, f"no PCI card {HUMUSOFT:04x}:{device:04x} (number {index}); see lspci -n"
        )
        maps = {}
        for bar in bars:
            path = folder / f"resource{bar}"
            try:
                size = path.stat().st_size
            except OSError as error:
                raise DriverMissing(f"{path}: the card has no such memory") from error
            maps[bar] = (_map(path, size, 0), 0, size)
        super().__init__(maps, str(folder))
