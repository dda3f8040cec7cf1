"""Registers in mapped memory: a tree of files in the place of the kernel's."""

from __future__ import annotations

import mmap
import subprocess
import sys
from pathlib import Path

import pytest

from hardware.devices.daq import MF624, MF634, MemoryRegisters, PciRegisters, UioRegisters
from hardware.devices.daq.registers import Access, AccessKind, Registers
from hardware.errors import DriverMissing, LinkLost

PAGE = mmap.PAGESIZE


def uio_tree(root: Path, number: int = 0, device: str = "0x0624", maps: int = 3) -> Path:
    """A UIO device with three maps; the second begins within its page, as small BARs do."""
    folder = root / f"sys/class/uio/uio{number}"
    (folder / "device").mkdir(parents=True)
    (folder / "device/vendor").write_text("0x186c\n")
    (folder / "device/device").write_text(device + "\n")
    for n in range(maps):
        entry = folder / f"maps/map{n}"
        entry.mkdir(parents=True)
        (entry / "size").write_text("0x80\n")
        (entry / "offset").write_text("0x400\n" if n == 1 else "0x0\n")
    (root / "dev").mkdir(exist_ok=True)
    node = root / f"dev/uio{number}"
    node.write_bytes(bytes(maps * PAGE))
    return node


def pci_tree(root: Path, device: str = "0x0634") -> Path:
    folder = root / "sys/bus/pci/devices/0000:03:00.0"
    folder.mkdir(parents=True)
    (folder / "vendor").write_text("0x186c\n")
    (folder / "device").write_text(device + "\n")
    for bar in (0, 2, 3):
        (folder / f"resource{bar}").write_bytes(bytes(128))
    return folder


def test_the_maps_of_the_driver_are_the_bars(tmp_path: Path) -> None:
    uio_tree(tmp_path, 0, "0x1234")
    node = uio_tree(tmp_path, 1)
    registers = UioRegisters(root=tmp_path)
    assert isinstance(registers, Registers)
    registers.write32(0, 0x54, 0x01020304)
    registers.write16(2, 0x20, 0x2000)
    registers.write16(4, 0x02, 0xBEEF)
    registers.close()
    registers.close()
    data = node.read_bytes()
    assert data[0x54:0x58] == b"\x04\x03\x02\x01"
    assert data[PAGE + 0x420 : PAGE + 0x422] == b"\x00\x20"
    assert data[2 * PAGE + 2 : 2 * PAGE + 4] == b"\xef\xbe"
    with pytest.raises(LinkLost, match="closed"):
        registers.read16(2, 0)


def test_a_card_powers_up_over_files(tmp_path: Path) -> None:
    uio_tree(tmp_path)
    card = MF624(UioRegisters(root=tmp_path))
    card.power_up()
    assert card.write(3, -5.0) == -5.0
    assert card.registers.read16(2, 0x26) == 0x1000
    card.close()

    folder = pci_tree(tmp_path)
    other = MF634(PciRegisters(root=tmp_path))
    other.power_up()
    other.close()
    assert (folder / "resource3").read_bytes()[0x6B] == 0x04
    assert (folder / "resource2").read_bytes()[0x20:0x30] == b"\x00\x20" * 8


def test_a_second_program_on_the_card_is_refused_until_the_first_lets_go(tmp_path: Path) -> None:
    uio_tree(tmp_path)
    pci_tree(tmp_path)
    for kind in (UioRegisters, PciRegisters):
        first = kind(root=tmp_path)
        with pytest.raises(LinkLost, match="another program drives this card"):
            kind(root=tmp_path)
        first.write32(0, 0x4, 7)
        first.close()
        again = kind(root=tmp_path)
        assert again.read32(0, 0x4) == 7
        again.close()


def test_one_card_by_two_ways_is_one_card(tmp_path: Path) -> None:
    uio_tree(tmp_path)
    folder = pci_tree(tmp_path, "0x0624")
    link = tmp_path / "sys/class/uio/uio0/device"
    for file in link.iterdir():
        file.unlink()
    link.rmdir()
    link.symlink_to(folder)
    first = UioRegisters(root=tmp_path)
    with pytest.raises(LinkLost, match="another program drives this card"):
        PciRegisters(0x0624, (0, 2), root=tmp_path)
    first.close()
    PciRegisters(0x0624, (0, 2), root=tmp_path).close()


def test_the_other_program_is_named_and_its_death_frees_the_card(tmp_path: Path) -> None:
    node = uio_tree(tmp_path)
    code = (
        "import fcntl, sys, time; f = open(sys.argv[1]); fcntl.flock(f, fcntl.LOCK_EX); "
        "print(flush=True); time.sleep(60)"
    )
    other = subprocess.Popen([sys.executable, "-c", code, str(node)], stdout=subprocess.PIPE)
    try:
        assert other.stdout is not None
        other.stdout.readline()
        with pytest.raises(LinkLost, match="another program drives this card") as refused:
            UioRegisters(root=tmp_path)
        assert "\n" not in str(refused.value)
        if f"FLOCK  ADVISORY  WRITE {other.pid} " in Path("/proc/locks").read_text():
            assert f"(process {other.pid}, " in str(refused.value)
    finally:
        other.kill()
        other.communicate()
    UioRegisters(root=tmp_path).close()


def test_a_card_that_cannot_be_opened_whole_is_not_held(tmp_path: Path) -> None:
    folder = pci_tree(tmp_path)
    (folder / "resource3").rename(folder / "away")
    with pytest.raises(DriverMissing, match="no such memory"):
        PciRegisters(root=tmp_path)
    (folder / "away").rename(folder / "resource3")
    PciRegisters(root=tmp_path).close()


def test_what_is_missing_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(DriverMissing, match="modprobe uio_mf624"):
        UioRegisters(root=tmp_path)
    with pytest.raises(DriverMissing, match="lspci"):
        PciRegisters(root=tmp_path)
    node = uio_tree(tmp_path)
    with pytest.raises(DriverMissing, match="number 1"):
        UioRegisters(root=tmp_path, index=1)
    node.unlink()
    with pytest.raises(DriverMissing, match="udev"):
        UioRegisters(root=tmp_path)
    uio_tree(tmp_path, 7, "0x0634", maps=1)
    with pytest.raises(DriverMissing, match="no map 1"):
        UioRegisters(0x0634, (0, 2, 3), root=tmp_path)
    (pci_tree(tmp_path) / "resource3").unlink()
    with pytest.raises(DriverMissing, match="no such memory"):
        PciRegisters(root=tmp_path)


def test_memory_that_is_too_short_is_a_lost_link(tmp_path: Path) -> None:
    uio_tree(tmp_path).write_bytes(b"")
    with pytest.raises(LinkLost, match="mapped"):
        UioRegisters(root=tmp_path)


def test_no_register_outside_or_across_its_width() -> None:
    memory = MemoryRegisters((0,), 16)
    for wrong in (
        lambda: memory.read16(0, 1),
        lambda: memory.read32(0, 14),
        lambda: memory.write16(0, 16, 0),
        lambda: memory.write32(0, -4, 0),
        lambda: memory.read16(1, 0),
    ):
        with pytest.raises(LinkLost):
            wrong()


def test_a_batch_keeps_its_order() -> None:
    memory = MemoryRegisters((0,))
    got = memory.batch(
        (
            Access(AccessKind.WRITE16, 0, 4, 7),
            Access(AccessKind.READ16, 0, 4),
            Access(AccessKind.WRITE32, 0, 4, 0x10009),
            Access(AccessKind.READ32, 0, 4),
            Access(AccessKind.READ16, 0, 4),
        )
    )
    assert got == [0, 7, 0, 0x10009, 9]
    assert len(memory.window(0)) == 128
