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
# # Two clocks: a loop width that is not there
#
# A converter plays the voltage by its own clock, an interferometer takes the length by another.
# Section 6.6 of the stack actuator thesis names this its biggest problem: the two rates, set equal,
# differ a little, and the start of one behind the other is not known. Both widen or narrow the
# hysteresis loop, the more the faster the drive, and look like rate-dependent hysteresis.
#
# Here the false width is made, seen, estimated and taken out. Set-up as there: 0 to 100 V, about
# 4.4 um, steps of 320 us, 32,768 samples at nominally 3125 Hz. The amplifier lags by 100 us; noise
# is 2 nm for the length and 10 mV at the actuator for the copy of the voltage.

# %%
import time

import matplotlib.pyplot as plt
import numpy as np

from bondgraph.hysteresis import AlJanaideh
from hardware.contracts import Flag
from hardware.simulators.rig import DeviceClock
from hardware.synchrony import (
    Budget,
    ClockWiring,
    HeldColumns,
    Stream,
    TimeMap,
    align,
    false_width,
    merged,
)

# %matplotlib inline
# %config InlineBackend.figure_formats = ['png']
plt.rcParams.update({"figure.dpi": 90, "axes.grid": True, "grid.alpha": 0.3})

RATE, SAMPLES, LAG = 3125.0, 32768, 100e-6
STACK = AlJanaideh.stack_2hz()
CLOCK = DeviceClock(ppm=37.0, offset=123e-6)  # of the interferometer, against the converter's
TRUTH = TimeMap(CLOCK.offset, 1e-6 * CLOCK.ppm)


def record(f, clock=CLOCK, seed=0):
    """What the converter was told, and what the sensor's clock took of it."""
    rng = np.random.default_rng(seed)
    drive_time = np.arange(SAMPLES + 300) / RATE
    volts = 50 - 50 * np.cos(2 * np.pi * f * drive_time)
    held = HeldColumns(volts[:, None], 1 / RATE, "zero", LAG)
    s = clock.instants(0.0, 0, SAMPLES, RATE)
    both = np.concatenate([s, drive_time])
    order = np.argsort(both, kind="stable")
    x = np.empty(both.size)
    x[order] = STACK.run(held.at(both[order])[0][:, 0])[0]
    sensor = Stream.of(
        RATE,
        x=x[:SAMPLES] + 2e-9 * rng.standard_normal(SAMPLES),
        V_copy=held.at(s)[0][:, 0] + 10e-3 * rng.standard_normal(SAMPLES),
    )
    return Stream.of(RATE, V=volts), sensor


def seen(drive, sensor, clocks):
    """Voltage and length over the last second, the voltage where these clocks put it."""
    held = HeldColumns(drive.channels["V"][:, None], 1 / RATE, "zero", LAG)
    late = slice(sensor.n - round(RATE), None)
    return held.at(clocks.to_drive(sensor.time[late]))[0][:, 0], sensor.channels["x"][late]


def width(volts, x):
    """Of the loop at 50 V: straight lines through both branches from 40 to 60 V."""
    up, near = np.gradient(volts) > 0, np.abs(volts - 50) < 10
    rise, fall = (np.polyfit(volts[near & b] - 50, x[near & b], 1)[1] for b in (up, ~up))
    return fall - rise


# %% [markdown]
# ## What a misfit of time makes of a sine
#
# `x = (X/2) sin w(t + d)` over `sin wt` crosses the middle at `+- (X/2) sin(w d)`: width
# `X sin(2 pi f d)`. With 10.49 s of record a skew of 100 ppm is a misfit of 1 ms at its end.

# %%
print("false width (nm) of 4.4 um after 10.49 s")
print("   skew       2 Hz    10 Hz   100 Hz")
table = {ppm: [1e9 * false_width(4.4e-6, f, 1e-6 * ppm * 10.49) for f in (2, 10, 100)]
         for ppm in (1, 10, 100)}  # fmt: skip
for ppm, row in table.items():
    print(f"{ppm:4d} ppm  " + "".join(f"{w:9.1f}" for w in row))
late = [1e9 * false_width(4.4e-6, f, 1 / RATE) for f in (2, 100)]
print(f"a trigger one sample late (320 us): {late[0]:.1f} nm at 2 Hz, {late[1]:.0f} nm at 100 Hz")
assert np.allclose(table[1], [0.58, 2.9, 29.0], rtol=0.01)
assert np.allclose(table[100][:2], [58, 290], rtol=0.01)
assert abs(late[0] - 17.7) < 0.05

# %% [markdown]
# ## The loops
#
# 37 ppm and 123 us, once taken as zero and once as they are.

# %%
records = {f: record(f) for f in (2.0, 100.0)}
figure, axes = plt.subplots(1, 2, figsize=(9.5, 3.8), sharey=True, constrained_layout=True)
for axis, (f, pair) in zip(axes, records.items(), strict=True):
    for label, clocks, style in (
        ("clocks taken as equal", TimeMap(), "C3."),
        ("true clocks", TRUTH, "C0."),
    ):
        v, x = seen(*pair, clocks)
        axis.plot(
            v, 1e6 * x, style, markersize=2, label=f"{label}: {1e9 * width(v, x):.0f} nm wide"
        )
    axis.set(title=f"{f:g} Hz, last second", xlabel="voltage at the actuator (V)")
    axis.legend(loc="upper left", markerscale=4)
axes[0].set_ylabel("length (um)")
plt.show()

# %% [markdown]
# The plant is the same rate-independent operator in both: its loop is as wide at 100 Hz as at 2 Hz.
# The red loop is the clocks' work alone.

# %% [markdown]
# ## With a copy of the voltage
#
# The copy is sampled together with the length, so it carries the interferometer's time. It is
# compared with what the converter put out: steps behind the amplifier's lag, not a smooth curve.

# %%
for f, pair in records.items():
    begun = time.perf_counter()
    found = align(*pair, ClockWiring(lag=LAG))
    took = time.perf_counter() - begun
    true, left, raw = (width(*seen(*pair, c)) for c in (TRUTH, found.map, TimeMap()))
    print(f"{f:g} Hz ({took:.2f} s)\n{found}")
    print(
        f"width {1e9 * true:.2f} nm; false by {1e9 * (raw - true):.1f} nm as recorded, "
        f"by {1e9 * (left - true):.3f} nm after alignment\n"
    )
    assert abs(found.map.skew - 37e-6) < 0.1e-6
    assert abs(found.map.delay - 123e-6) < 1.5e-6
    assert abs(left - true) < (1e-9 if f < 10 else 5e-9)
    assert abs(raw - true) > 5e-9

# %% [markdown]
# On one time base nothing measured has to be interpolated: the sensor's own instants are even by
# the drive's clock too, and the voltage is known everywhere.

# %%
together = merged(*records[100.0], align(*records[100.0], ClockWiring(lag=LAG)))
print(together.sentence)
assert together.errors["x"] == 0.0

# %% [markdown]
# The lag of the amplifier need not be known: the way the copy settles within its steps shows it,
# as long as the record holds enough of it.

# %%
found = align(*records[2.0], budget=Budget(width=1e-9, stroke=4.4e-6, frequency=2.0))
print(found)
low, high = found.delay_interval
assert low < 123e-6 < high
assert abs(found.lag - LAG) < 3e-6

# %% [markdown]
# ## Without it: one sine cannot tell
#
# The phase of the answer must not drift, so the ratio is there. A constant delay, though, is a
# constant phase, and so is the lag of the loop. Below, two records whose delays differ by half a
# sample: the second plant's loop is wider or narrower by as much as its clock is late.

# %%
alone = {d: record(2.0, DeviceClock(ppm=37.0, offset=d)) for d in (0.0, 160e-6)}
for delay, (drive, sensor) in alone.items():
    found = align(drive, Stream.of(RATE, x=sensor.channels["x"]))
    v, x = seen(drive, sensor, found.map)
    print(f"truly {1e6 * delay:.0f} us late; {found.sentence}; width with what is assumed "
          f"{1e9 * width(v, x):.0f} nm\n")  # fmt: skip
    low, high = found.skew_interval
    assert low < 37e-6 < high
    assert not found.delay_known
    assert found.flag is Flag.UNSYNCHRONISED
    assert found.map.delay == 0.0  # assumed, not guessed

# %% [markdown]
# Every sample of such a record carries the flag `UNSYNCHRONISED`. What cures it: the external clock
# input of the interferometer, a copy of the voltage, an edge in the drive, or a known trigger.
#
# ## A copy that is too good
#
# If the copy follows a step faster than a sample, and both rates are equal, it shows which step is
# held but not since when. All time maps that put every sample into its step are equally likely;
# their set is what is reported. Rates that do not divide each other see the edges at all phases.

# %%
half = {}
for drive_rate in (3125.0, 2717.0):
    drive_time = np.arange(int(10.6 * drive_rate)) / drive_rate
    volts = 50 - 50 * np.cos(2 * np.pi * 2.0 * drive_time)
    s = CLOCK.instants(0.0, 0, SAMPLES, RATE)
    copy = HeldColumns(volts[:, None], 1 / drive_rate).at(s)[0][:, 0]
    copy = copy + 10e-3 * np.random.default_rng(3).standard_normal(SAMPLES)
    found = align(
        Stream.of(drive_rate, V=volts), Stream.of(RATE, V_copy=copy), ClockWiring(lag=0.0)
    )
    low, high = found.delay_interval
    half[drive_rate] = (high - low) / 2
    print(f"converter at {drive_rate:g} Hz: {found.sentence}")
    assert low <= 123e-6 <= high
assert half[2717.0] < 1.5e-6 < 20e-6 < half[3125.0]

# %% [markdown]
# ## Lost samples and a drifting ratio

# %%
drive, sensor = records[2.0]
kept = np.r_[0:12345, 12382:SAMPLES]
found = align(drive, Stream.of(RATE, V_copy=sensor.channels["V_copy"][kept]), ClockWiring(lag=LAG))
print(found)
assert [(g.first, g.missing) for g in found.gaps] == [(12345, 37)]

drift = DeviceClock(ppm=-20.0, offset=123e-6, drift_ppm=120.0)
found = align(*record(2.0, drift), ClockWiring(lag=LAG, drifting=True))
print(found.sentence)
low, high = found.drift_interval
assert low < 120e-6 / 60 < high
