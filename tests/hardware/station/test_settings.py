"""Station files: what they may say, and one line for everything else."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from bondgraph.support.errors import BondsightError
from hardware.envelope import P840_1_UNIPOLAR
from hardware.errors import DriverMissing, HardwareError
from hardware.station import open_station, read_settings, settings_from

GOOD = """
name = "laboratory"

[envelope]
preset = "P-840.1-unipolar"
v_max = 80

[output]
kind = "mf634"
trigger = 0
clock = 1

[amplifier]
gain = 20.0
voltage_monitor = 0.05

[interferometer]
connection = "usb:0"
dead_path = 0.1

[noise]
x = 2e-9
"""


def test_a_file_is_read(tmp_path: Path) -> None:
    file = tmp_path / "station.toml"
    file.write_text(GOOD)
    s = read_settings(file)
    assert s.name == "laboratory"
    assert s.envelope.v_max == 80.0
    assert s.envelope.slew == P840_1_UNIPOLAR.slew
    assert (s.output.kind, s.output.trigger, s.output.clock) == ("mf634", 0, 1)
    assert s.amplifier.voltage_monitor == 0.05
    assert s.interferometer is not None
    assert s.interferometer.dead_path == 0.1
    assert s.clock.bench == ""
    assert s.noise == {"x": 2e-9}


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (("kind =", "knd ="), "did you mean 'kind'"),
        (('kind = "mf634"', ""), "needs its field 'kind'"),
        (('"mf634"', '"mf643"'), "did you mean 'mf634'"),
        (("gain", "gian"), "did you mean 'gain'"),
        (("20.0", '"20"'), ""),
        (("20.0", "true"), "amplifier.gain: true is not a number"),
        (("trigger = 0", "trigger = -1"), "at least 0"),
        (("trigger = 0", "trigger = 0.5"), "whole number"),
        (('"P-840.1-unipolar"', '"P-841"'), "did you mean"),
        (('preset = "P-840.1-unipolar"', "v_min = 0"), "slew is missing"),
        (("v_max = 80", "v_max = nan"), "not a finite number"),
        (("v_max = 80", "v_max = -80"), ""),
        (("[amplifier]", "[amplifeir]"), "did you mean 'amplifier'"),
        (("dead_path = 0.1", "dead_path = [1]"), "not a finite number"),
        (("[output]", "[output"), "is no TOML"),
        (("x = 2e-9", "x = -2e-9"), "noise.x: -2e-09 is not a number above 0"),
        (('connection = "usb:0"', "connection = 3"), "interferometer.connection: 3 is not text"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(
    tmp_path: Path, change: tuple[str, str], says: str
) -> None:
    file = tmp_path / "station.toml"
    assert change[0] in GOOD
    file.write_text(GOOD.replace(*change))
    if not says and "20" in change[1]:
        # a number written as a text is taken as the number it is
        assert read_settings(file).amplifier.gain == 20.0
        return
    with pytest.raises(BondsightError) as caught:
        read_settings(file)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


def test_absent_files_and_devices_are_named(tmp_path: Path) -> None:
    with pytest.raises(BondsightError, match="cannot be read"):
        read_settings(tmp_path / "none.toml")
    table: dict[str, Any] = {
        "envelope": {"preset": "P-840.1"},
        "output": {"kind": "mf634"},
    }
    with pytest.raises(DriverMissing):
        open_station(settings_from(table))
    table["clock"] = {"bench": "127.0.0.1:9"}
    with pytest.raises(HardwareError, match="bondsight bench serve"):
        open_station(settings_from(table))
    for address in ("", "here", "127.0.0.1:x"):
        table = {
            "envelope": {"preset": "P-840.1"},
            "output": {"kind": "gcs", "address": address},
        }
        with pytest.raises(BondsightError, match="HOST:PORT"):
            open_station(settings_from(table))
