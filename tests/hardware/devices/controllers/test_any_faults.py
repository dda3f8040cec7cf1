"""Whatever happens on the wire: a value is right or there is an error, and nothing is misplaced."""

from __future__ import annotations

from contextlib import suppress

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hardware.devices.controllers import ASCII_DIALECTS, AsciiController, GcsController
from hardware.devices.transport import SerialTransport
from hardware.errors import HardwareError, LinkLost
from hardware.simulators.control.client import LocalClock
from hardware.simulators.controllers import AsciiFront, Fault
from hardware.simulators.rig import Rig
from tests.hardware.devices.controllers.bench import Spring, bench

TIMEOUT = 0.02
FAULTS = st.builds(
    Fault,
    delay=st.sampled_from([0.0, 0.0, 0.005, 0.025, 0.05]),
    chunk=st.sampled_from([0, 1, 2, 5]),
    pause=st.sampled_from([0.0, 0.001, 0.008]),
    garbage=st.sampled_from([b"", b"", b"\xff", b"\n", b"1=99.0\n", b"0\n", b">", b"\x11"]),
    terminator=st.sampled_from([None, None, None, b"", b"\r", b" \n"]),
    silent=st.sampled_from([False, False, False, True]),
    drop_after=st.sampled_from([None, None, None, None, None, 2]),
)
STEPS = st.lists(
    st.tuples(st.lists(FAULTS, max_size=2), st.sampled_from(["write", "read", "position"])),
    min_size=1,
    max_size=5,
)
BRIEF = settings(
    max_examples=12,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.too_slow],
)
THOROUGH = settings(BRIEF, max_examples=300)


def opened(controller: GcsController | AsciiController) -> None:
    """Open it; a machine under load, or an answer still on its way, may take some tries."""
    for _ in range(50):
        with suppress(HardwareError):
            controller.close()
            controller.open()
            return
    raise AssertionError("cannot be opened")


def gcs_stays_right(way: str, steps: list[tuple[list[Fault], str]]) -> None:
    with bench(way, timeout=TIMEOUT) as there:
        opened(there.controller)
        for number, (faults, action) in enumerate(steps):
            there.front.faults.next(*faults)
            stands = there.rig.volts
            try:
                if action == "write":
                    there.controller.write(10.0 + number)
                    assert there.rig.volts == 10.0 + number
                elif action == "read":
                    assert there.controller.read() == stands
                else:
                    there.rig.wait(0.001)
                    assert there.controller.position() == pytest.approx(3e-8 * stands, abs=1e-12)
            except LinkLost:
                there.front.faults.clear()
                opened(there.controller)
            except HardwareError:
                pass
            assert there.rig.volts in (stands, 10.0 + number)


def ascii_stays_right(name: str, steps: list[tuple[list[Fault], str]]) -> None:
    rig = Rig(Spring())
    front = AsciiFront(rig, name)
    line = SerialTransport(front.start())
    controller = AsciiController(ASCII_DIALECTS[name], line, LocalClock(rig), TIMEOUT)
    try:
        opened(controller)
        with suppress(LinkLost):
            for number, (faults, action) in enumerate(steps):
                front.faults.next(*faults)
                stands = rig.volts
                with suppress_all_but_lost():
                    if action == "write":
                        controller.write(10.0 + number)
                        assert rig.volts == 10.0 + number
                    else:
                        assert controller.read() == stands
                assert rig.volts in (stands, 10.0 + number)
    finally:
        controller.close()
        front.stop()


class suppress_all_but_lost:
    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: type[BaseException] | None, error: object, trace: object) -> bool:
        return kind is not None and issubclass(kind, HardwareError) and kind is not LinkLost


@given(STEPS)
@BRIEF
def test_own_client(steps: list[tuple[list[Fault], str]]) -> None:
    gcs_stays_right("own", steps)


@given(STEPS)
@settings(BRIEF, max_examples=6)
def test_pisocket(steps: list[tuple[list[Fault], str]]) -> None:
    gcs_stays_right("pisocket", steps)


@pytest.mark.parametrize("name", sorted(ASCII_DIALECTS))
@given(steps=STEPS)
@settings(BRIEF, max_examples=6)
def test_ascii(name: str, steps: list[tuple[list[Fault], str]]) -> None:
    ascii_stays_right(name, steps)


@pytest.mark.long
@pytest.mark.parametrize("way", ["own", "pisocket"])
@given(steps=STEPS)
@THOROUGH
def test_gcs_thoroughly(way: str, steps: list[tuple[list[Fault], str]]) -> None:
    gcs_stays_right(way, steps)


@pytest.mark.long
@pytest.mark.parametrize("name", sorted(ASCII_DIALECTS))
@given(steps=STEPS)
@THOROUGH
def test_ascii_thoroughly(name: str, steps: list[tuple[list[Fault], str]]) -> None:
    ascii_stays_right(name, steps)
