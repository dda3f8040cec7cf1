"""Dialects of some controllers, from public programs for them; none was tried on a device here."""

from types import MappingProxyType

from hardware.devices.controllers.ascii_dialect import AsciiDialect

_NUMBER = r"([-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?)"
_JENA_FRAME = b"\x11\x13\r\n\x01\x00 "
# of the codes 1 to 10 these three are about ranges
_JENA_REFUSALS = ((r"^error,(?:4|9|10)\b", True), (r"^error\b", False))

NV200 = AsciiDialect(
    name="nv200",
    maker="piezosystem jena",
    model="NV200/D",
    command_end=b"\r\n",
    answer_end=b"\x11",
    framing=_JENA_FRAME,
    identity=(("desc", r"^desc,(.*)"), ("acserno", r"^acserno,(.*)")),
    prepare=("modsrc,0", "cl,0"),
    set_voltage="set,{volts:.3f}",
    read_voltage="set",
    voltage_pattern=rf"^set,{_NUMBER}$",
    lowest=("avmin", rf"^avmin,{_NUMBER}$"),
    highest=("avmax", rf"^avmax,{_NUMBER}$"),
    refusals=_JENA_REFUSALS,
    echoes_setpoint=0.02,
    source="nv200 (maker's Python library on PyPI): commands, error codes, 115200 baud, XON as end",
    unseen="whether a bare XON follows a command without an answer (both are understood); the "
    "voltage is the setpoint, the device's measurement of it is not read",
)
"""One channel, open loop; ``desc`` and ``acserno`` name the actuator that is plugged in."""

D_DRIVE = AsciiDialect(
    name="d-drive",
    maker="piezosystem jena",
    model="d-Drive, channel 0",
    command_end=b"\r\n",
    answer_end=b"\x11",
    framing=_JENA_FRAME,
    identity=(("acdescr,0", r"^acdescr,0,(.*)"),),
    prepare=("cl,0,0",),
    set_voltage="set,0,{volts:.3f}",
    read_voltage="set,0",
    voltage_pattern=rf"^set,0,{_NUMBER}$",
    refusals=_JENA_REFUSALS,
    echoes_setpoint=0.02,
    source="psj-lib (maker's Python library on PyPI): commands; a public control system's notes on "
    "the older EDS: XOFF, text, CR LF, XON",
    unseen="the order of channel and value, the answer to a command, the error codes",
)
"""Channel 0, open loop; for another channel replace the numbers in a copy."""

MDT69X = AsciiDialect(
    name="mdt69x",
    maker="Thorlabs",
    model="MDT693B / MDT694B, x",
    command_end=b"\n",
    answer_end=b">",
    framing=b"\r\n> *",
    identity=(("id?", r"Model (\S+)"),),
    set_voltage="xvoltage={volts:.3f}",
    read_voltage="xvoltage?",
    voltage_pattern=rf"^\[\s*{_NUMBER}\s*\]$",
    lowest=("xmin?", rf"^\[\s*{_NUMBER}\s*\]$"),
    highest=("xmax?", rf"^\[\s*{_NUMBER}\s*\]$"),
    refusals=((r"CMD_ARG_RANGE", True), (r"CMD_\w+", False)),
    echo=True,
    source="two public Python programs for MDT693B and MDT694B: commands, 115200 baud, echo, "
    "prompt, brackets, CMD_NOT_DEFINED",
    unseen="the text with which a voltage out of range is refused; the voltage is the measured one "
    "and follows slowly",
)
"""Channel x of the controllers with a switch for 75, 100 or 150 V."""

ASCII_DIALECTS = MappingProxyType({d.name: d for d in (NV200, D_DRIVE, MDT69X)})
"""Dialects by name."""
