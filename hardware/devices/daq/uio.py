"""Registers of a real card on Linux: by its UIO driver, or by the resource files of PCI.

The kernel's ``uio_mf624`` serves the MF624 only and maps its BARs 0, 2 and 4 in this order. For an
MF634 the kernel maps nothing; its BARs are reached as ``resourceN`` in sysfs, which needs root (or
a udev rule) and no other driver (comedi) on the card.
"""

from __future__ import annotations

import contextlib
import mmap
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import final

from hardware.devices.daq.holding import held
from hardware.devices.daq.mapped import MappedRegisters
from hardware.errors import DriverMissing, LinkLost

HUMUSOFT = 0x186C
_PAGE = mmap.PAGESIZE
_BOTH_WAYS = os.O_RDWR | getattr(os, "O_SYNC", 0)


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
    """Registers in mapped files, which no other program may hold at the same time."""

    def __init__(
        self,
        maps: Mapping[int, tuple[mmap.mmap, int, int]],
        address: str,
        opened: contextlib.ExitStack,
    ) -> None:
        self._opened = opened
        super().__init__({b: memoryview(m)[o : o + n] for b, (m, o, n) in maps.items()}, address)

    def close(self) -> None:
        """Let go of the memory and of the files."""
        super().close()
        self._opened.close()


def _map(
    file: int, path: Path, length: int, offset: int, opened: contextlib.ExitStack
) -> mmap.mmap:
    try:
        mapped = mmap.mmap(file, length, mmap.MAP_SHARED, offset=offset)
    except (OSError, ValueError) as error:
        raise LinkLost(f"{path}: its memory cannot be mapped ({error}); is the card alive?") from (
            error
        )
    opened.callback(_unmap, mapped)
    return mapped


def _unmap(mapped: mmap.mmap) -> None:
    # compiled code may still hold a pointer; the process's end unmaps it
    with contextlib.suppress(BufferError):
        mapped.close()


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
    LinkLost
        Another program drives the card, or its memory cannot be mapped.
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
        with contextlib.ExitStack() as opened:
            # the card itself: it can also be reached by its resource files
            held(folder / "device", os.O_RDONLY, opened)
            file = held(node, _BOTH_WAYS, opened)
            for n, bar in enumerate(bars):
                size = _number(folder / f"maps/map{n}/size")
                if size is None:
                    raise DriverMissing(f"{node}: its driver has no map {n}; expected {len(bars)}")
                inner = _number(folder / f"maps/map{n}/offset") or 0
                whole = -(-(inner + size) // _PAGE) * _PAGE
                maps[bar] = (_map(file, node, whole, n * _PAGE, opened), inner, size)
            super().__init__(maps, str(node), opened.pop_all())


@final
class PciRegisters(_OpenedRegisters):
    """Registers by ``/sys/bus/pci/devices/*/resourceN``; all as in `UioRegisters`."""

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
        with contextlib.ExitStack() as opened:
            # the card itself: it can also be reached by a UIO driver
            held(folder, os.O_RDONLY, opened)
            for bar in bars:
                path = folder / f"resource{bar}"
                try:
                    size = path.stat().st_size
                except OSError as error:
                    raise DriverMissing(f"{path}: the card has no such memory") from error
                file = held(path, _BOTH_WAYS, opened)
                maps[bar] = (_map(file, path, size, 0, opened), 0, size)
            super().__init__(maps, str(folder), opened.pop_all())
