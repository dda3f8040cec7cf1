"""Whatever a program does in whatever order, the stack meets only what was commanded."""

from __future__ import annotations

import contextlib

from hypothesis import given, settings
from hypothesis import strategies as st

from hardware.errors import HardwareError
from hardware.simulators.registers import CardFront
from hardware.simulators.rig import Rig
from tests.hardware.devices.daq.bench import Capacitor, card_on

STEPS = st.one_of(
    st.tuples(st.just("write"), st.floats(-12.0, 12.0)),
    st.tuples(
        st.sampled_from(
            ["power_up", "adopt", "convert", "off", "reopen", "power_cycle", "gone", "back", "line"]
        ),
        st.just(0.0),
    ),
    st.tuples(st.just("hold"), st.floats(-10.0, 10.0)),
)


@settings(max_examples=150, deadline=None)
@given(st.sampled_from(["MF624", "MF634"]), st.lists(STEPS, max_size=30))
def test_the_reset_value_never_reaches_the_stack(
    model: str, steps: list[tuple[str, float]]
) -> None:
    rig = Rig(Capacitor())
    front = CardFront(rig, model=model)
    card = card_on(front, rig)
    commanded = {0.0}
    for what, volts in steps:
        rig.wait(1e-4)
        with contextlib.suppress(HardwareError):
            if what == "write":
                if abs(volts) <= 10.0:
                    commanded.add(volts)
                card.write(0, volts)
            elif what == "hold":
                # another program leaves a value behind that is not loaded yet
                bar, control = front.registers.CONTROL[model]
                word = front.registers.read32(bar, control)
                front.registers.write32(bar, control, word | 1 << 23)
                front.registers.write16(2, 0x20, 0x3FFF)
            elif what == "reopen":
                card = card_on(front, rig)
            elif what == "power_cycle":
                front.registers.power_cycle()
            elif what in ("gone", "back"):
                front.faults.gone = what == "gone"
            elif what == "convert":
                card.convert([0])
            elif what == "line":
                card.set_line(1, True)
            else:
                {"power_up": card.power_up, "adopt": card.adopt, "off": card.switch_off}[what]()
    assert rig.extremes.lowest >= 20.0 * min(commanded) - 0.02
    assert rig.extremes.highest <= 20.0 * max(commanded) + 0.02
