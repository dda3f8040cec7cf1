# ---
# jupyter:
#   jupytext:
#     formats: ipynb,py:percent
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # A bench session
#
# From an actuator with an unknown past to the name of what its model lacks: power up, demagnetise,
# record, survive a lost beam, diagnose.
#
# The bench is virtual, the wire is not. An output card answers register by register on a socket; an
# interferometer answers through a C library with the vendor's interface (so `gcc` is needed). The
# same program, with other addresses, drives a real bench. Time on the bench passes only when the
# program waits, so a run takes seconds and gives the same numbers each time.

# %%
EFFECT, PLACE, STRENGTH = "hysteresis", "C_nl", "strong"  # concealed; "drawn", "", "" to wonder
SEED = 1  # of the plant; None for one that nobody knows
SAMPLES, RATE = 4096, 10e3  # of the record, Hz

# %%
import hashlib
import os
import tomllib
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from textwrap import fill

import matplotlib.pyplot as plt
import numpy as np
from threadpoolctl import threadpool_limits

from actuators.catalogue import stack_with_payload
from bondgraph import Recording
from hardware.contracts import Flag
from hardware.envelope import parked
from hardware.errors import BeamLost, LimitViolation
from hardware.recorder import Plan, record
from hardware.simulators import Truth
from hardware.simulators.bench_server import BenchServer
from hardware.simulators.bench_server.config import config_from
from hardware.simulators.siosifm import build
from hardware.station import open_station, settings_from
from hardware.storage import Provenance, flags_of, open_journal, recover
from identification.command_line.acquire_signal import limits_of
from identification.command_line.demo import describe, judge
from identification.design import demagnetise, through
from identification.design.take import session_signal
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.search import Options
from identification.diagnosis.verdict import normalised_error, sentence, verdict

threadpool_limits(1)  # small matrices: threads would only wait for each other
# %matplotlib inline
# %config InlineBackend.figure_formats = ['png']
plt.rcParams.update({"figure.dpi": 90, "axes.grid": True, "grid.alpha": 0.3})


def say(*texts):
    """Print with long lines folded."""
    print("\n".join(fill(str(text), 100, subsequent_indent="      ") for text in texts))


# %% [markdown]
# ## The bench
#
# On it stands a piezo stack with a load, in plain equations of its own that share no code with the
# models. Something is concealed in it. The interferometer's clock is 35 ppm off, the room warms up
# by 2 K an hour, and its air is stirred a little. The truth is sealed: its hash is shown now, the
# rest at the end.

# %%
server = BenchServer(
    config_from(
        {
            "plant": {"effect": EFFECT, "place": PLACE, "strength": STRENGTH, "seed": SEED},
            "interferometer": {"ppm": 35.0, "jitter": 20e-9},
            "air": {"kelvin_per_hour": 2.0, "stir": 1e-3},
        }
    )
)
address = server.start()
sealed = server.envelope.hash
print(f"truth sealed: sha256 {sealed}")

# %% [markdown]
# ## The station
#
# What a person writes once about a bench: limits, wiring, gains. `bondsight acquire` reads it from
# a file; `[clock]` is only there because this bench is virtual. Line 0 of the card goes to the
# interferometer's clock input.

# %%
folder = TemporaryDirectory()
target = Path(folder.name)
os.environ["BONDSIGHT_SIOS_LIB"] = str(build(target))  # the vendor's, on a real bench

STATION = f"""
name = "stack on the virtual bench"

[envelope]
preset = "P-840.1-unipolar"

[clock]
bench = "{address["control"]}"

[output]
kind = "mf634"
address = "{address["card"]}"
trigger = 0
clock = 0

[amplifier]
gain = 20.0
voltage_monitor = 0.05

[interferometer]
connection = "net:{address["interferometer"]}"
dead_path = 0.1
"""
settings = settings_from(tomllib.loads(STATION))
bench = open_station(settings)
say(bench.output.identity, bench.interferometer.identity, bench.output.status)

# %% [markdown]
# ## The envelope
#
# One object stands between every command and the amplifier. What does not fit is refused before a
# byte leaves.

# %%
say(settings.envelope.describe(), "")
bench.output.power_up()
say(bench.output.status, "")

t = np.arange(200) / RATE
fast = 50.0 + 50.0 * np.sin(2 * np.pi * 500.0 * t)
unclear = np.where(t == t[120], np.nan, 50.0)
trials = {
    "ramp to 150 V": lambda: bench.output.ramp(150.0),
    "jump to 90 V": lambda: bench.output.set(90.0),
    "a sine of 500 Hz": lambda: bench.station(Plan(fast, RATE)).wave.prepare(fast, RATE),
    "a wave with a NaN": lambda: bench.station(Plan(t, RATE)).wave.prepare(unclear, RATE),
}
refused = []
for what, trial in trials.items():
    try:
        trial()
    except LimitViolation as error:
        refused.append(what)
        say(f"{what}: {error}")

assert refused == list(trials)
assert server.extremes.lowest == server.extremes.highest == 0.0
print("\nthe actuator has seen 0 V all the time")

# %% [markdown]
# ## Zero, and the air
#
# The interferometer counts fringes from where it is zeroed. The air of the dead path, 0.1 m of beam
# that do not belong to the motion, is in every reading: when it warms, the mirror seems to move.
# The device measures the air and takes that off.

# %%
DEAD_PATH = settings.interferometer.dead_path
times, airs, lengths = [], [], []
bench.interferometer.zero()
for _ in range(13):
    times.append(bench.clock.now())
    airs.append(bench.interferometer.air())
    lengths.append(np.mean([bench.interferometer.read().value for _ in range(20)]))
    bench.clock.sleep(10.0)
warmer = airs[-1].temperature - airs[0].temperature
moved = DEAD_PATH * (airs[-1].index - airs[0].index)
print(f"{times[-1] - times[0]:.0f} s: {1e3 * warmer:+.0f} mK, index now {airs[-1].index:.9f}")
print(f"in the dead path that is worth {1e9 * moved:+.1f} nm; the corrected reading went by "
      f"{1e9 * (lengths[-1] - lengths[0]):+.1f} nm")  # fmt: skip
import time; print(time.process_time(), [round(1e9*x,2) for x in lengths])
