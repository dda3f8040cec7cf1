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
EFFECT, PLACE, STRENGTH = "hysteresis", "k", "strong"  # concealed; "drawn", "", "" to wonder
SEED = 1  # of the plant; None for one that nobody knows
SAMPLES, RATE = 4096, 10e3  # of the record, Hz
untouched = (EFFECT, PLACE, STRENGTH, SEED, SAMPLES, RATE) == (
    "hysteresis", "k", "strong", 1, 4096, 10e3,
)  # fmt: skip

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

from actuators.models.catalogue import stack_on_bench
from bondgraph import Recording
from bondsight.cli.judged import describe, judge
from hardware.contracts import Flag
from hardware.envelope import parked
from hardware.errors import BeamLost, LimitViolation
from hardware.recorder import TakePlan, record
from hardware.simulators.bench_server import BenchServer
from hardware.simulators.bench_server.config import config_from
from hardware.simulators.judging.truths import truth_of
from hardware.simulators.siosifm import build
from hardware.station import open_station, settings_from
from hardware.storage import Provenance, flags_of, open_journal, recover
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.diagnosis.verdict import normalised_error, sentence, verdict
from identification.experiments.design import demagnetise, through
from identification.experiments.design.take import session_signal

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
clocked = "block"
"""
settings = settings_from(tomllib.loads(STATION))
bench = open_station(settings)
for device in (bench.output.identity, bench.interferometer.identity):
    print(device.maker, device.model, device.serial)
say(bench.output.status)

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
    "a sine of 500 Hz": lambda: bench.station(TakePlan(fast, RATE)).wave.prepare(fast, RATE),
    "a wave with a gap (NaN)": lambda: bench.station(TakePlan(t, RATE)).wave.prepare(unclear, RATE),
}
refused = []
for what, trial in trials.items():
    try:
        trial()
    except LimitViolation as error:
        refused.append(what)
        say(f"{what}: {error}")

assert refused == list(trials)
assert server.extremes.lowest == 0.0
assert server.extremes.highest < 2.1
print("\nthe actuator has seen nothing but the 2 V by which the power-up proves the monitor")

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
assert abs(moved) > 5e-9
if untouched:
    assert max(map(abs, lengths)) < 2e-9

# %% [markdown]
# ## Demagnetise
#
# A hysteretic actuator remembers. Below it is brought to 50 V three ways: from 0 V, from 100 V, and
# by swings that decay around 50 V, twice. Recording is one call: the wave is checked, powered up
# to, zeroed at its first value, played and stored; every sample of the card clocks one of the
# interferometer.

# %%
MIDDLE, SLOW = 50.0, 2e3  # V, Hz
LIMITS = settings.envelope.limits
rest = np.full(40, MIDDLE)


def excursion(end):
    """There and back, by no more than 2 kV/s."""
    return through([MIDDLE, end, MIDDLE], SLOW, slew=2e3).values


decay = demagnetise(
    np.arange(8.0, 49.0, 8.0), MIDDLE, SLOW, frequency=25.0, start=MIDDLE, envelope=LIMITS
).values
parts = [rest, excursion(0), rest, decay, rest, excursion(100), rest, decay, rest]
plan = TakePlan(np.concatenate(parts), SLOW, "memory")
memory = record(bench.station(plan), plan, target / "memory").recording
print(f"{memory.n} samples; {bench.output.status}")

# %%
ends = np.cumsum([p.size for p in parts])[::2]
nm = 1e9 * memory["x"]
at_rest = np.array([nm[e - 20 : e].mean() for e in ends])
ways = ["start", "from 0 V", "decayed", "from 100 V", "decayed"]
for way, value in zip(ways, at_rest, strict=True):
    print(f"length at 50 V, {way:10s} {value:7.1f} nm")

slope = np.polyfit(memory["V"], nm, 1)
figure, axes = plt.subplots(1, 2, figsize=(10, 3.8), constrained_layout=True)
axes[0].plot(memory.time, memory["V"], color="0.4", lw=0.7)
last = slice(ends[2], None)  # up to 100 V, back, and the decay
bent = nm - slope[0] * (memory["V"] - MIDDLE)
axes[1].plot(memory["V"][last], bent[last], color="0.4", lw=0.7)
for k, colour in ((1, "C3"), (3, "C1"), (4, "C0")):
    axes[0].plot(memory.time[ends[k] - 20], MIDDLE, "o", color=colour, zorder=3)
    axes[1].plot(MIDDLE, at_rest[k], "o", color=colour, label=ways[k], zorder=3)
axes[0].set(xlabel="time (s)", ylabel="voltage (V)", title="the wave")
axes[1].set(xlabel="voltage (V)", ylabel="length less a straight line (nm)", title="second half")
axes[1].set_ylim(bottom=1.6 * bent[last].min())
axes[1].legend(title="at rest at 50 V", loc="lower center", ncols=3)
plt.show()

# %% [markdown]
# What the past does to the length is gone after the decay: both times it ends in the middle.

# %%
if untouched:
    assert at_rest[3] - at_rest[1] > 80
    assert abs(at_rest[4] - at_rest[2]) < 2
    assert abs(at_rest[4] - (at_rest[3] + at_rest[1]) / 2) < 5

# %% [markdown]
# ## The record
#
# Swings with minor loops at several levels and a multisine on top, from which most effects can be
# told apart. A take parks the output at its end; the demagnetisation must not, since the record has
# to begin where it ends. So both stand under one guard, which parks also on errors and on Ctrl-C.

# %%
volts = session_signal(RATE, SAMPLES, LIMITS, bias=MIDDLE, seed=4).values
plan = TakePlan(volts, RATE, "session")
erase = TakePlan(decay, SLOW, "erase")
steps = []
with parked(bench.output):
    record(replace(bench.station(erase), safety=nullcontext()), erase, target / "erase")
    taken = record(bench.station(plan), plan, target / "session", watch=steps.append)
edges = np.array(server.rig.trigger_edges[-SAMPLES:])  # for the end, when the seal is open

session = Recording.open(taken.path)
say(f"{taken.path.name}: {session.n} samples of {', '.join(session.channels)}",
    " -> ".join(dict.fromkeys(s.phase for s in steps)), bench.output.status)  # fmt: skip

figure, rows = plt.subplots(2, 1, figsize=(10, 4.4), sharex=True, constrained_layout=True)
for row, name, scale, unit in zip(rows, ("V", "x"), (1, 1e6), ("V", "um"), strict=True):
    row.plot(session.time, scale * session[name], color="0.25", lw=0.6)
    row.set_ylabel(f"{name} ({unit})")
rows[1].set_xlabel("time (s)")
plt.show()

# %% [markdown]
# ## What is known about it
#
# The recording says where it comes from, and beside it lies the journal: the raw streams as they
# arrived, with every event.

# %%
about = Provenance.of(session)
for stream in about.streams:
    d = stream.device
    say(f"{stream.stream}: {' '.join(filter(None, (d.maker, d.model, d.serial)))}, {stream.samples} samples, "
        f"{stream.lost} lost, {stream.measured_rate or stream.nominal_rate:g} Hz")  # fmt: skip
say(f"clocks: {about.alignment.method}; {about.alignment.remark}",
    f"air: {about.air.temperature - 273.15:.2f} degC, index {about.air.index:.9f}, "
    f"{'measured' if about.air.measured else 'assumed'}",
    f"envelope: {about.envelope['envelope']['name']}, output {about.output_end} at the end",
    f"flagged samples: {np.count_nonzero(flags_of(session))}",
    *(f"note: {w}" for w in about.warnings))  # fmt: skip
raw = open_journal(taken.journal)
events = [n.content["event"] for n in raw.notes if "event" in n.content]
say(f"journal: {', '.join(raw.streams)}, closed: {raw.closed}; events: {', '.join(events)}")

worst = server.extremes
print(f"the actuator has met {worst.lowest:.3f} to {worst.highest:.3f} V")
assert session.n == SAMPLES
assert np.abs(session["V"] - volts).max() <= 0.5 * bench.output.converter.resolution + 1e-9
assert about.output_end == "parked"
assert server.rig.volts == 0.0
assert not flags_of(session).any()
assert (about.alignment.method, about.alignment.ratio) == ("shared clock", 1.0)
assert settings.envelope.v_min <= worst.lowest
assert worst.highest <= settings.envelope.v_max
assert raw.closed
assert raw.read("interferometer").n == raw.read("output").n == SAMPLES

# %% [markdown]
# The converter has 14 bits, so the stored voltage is what it made of the command, not the command.
# The clock of the interferometer plays no part where the card clocks it; with two free clocks the
# ratio is estimated instead, see the notebook on clocks.
#
# ## The same with a lost beam
#
# A hand in the beam at sample 1500: from there on the fringe counter is worth nothing.

# %%
server.control.answer("FAULT interferometer beam_loss_at=1500")
caught = ""
try:
    record(bench.station(plan), plan, target / "broken")
except BeamLost as error:
    caught = str(error)
    say(f"BeamLost: {error}", *error.__notes__)
say(bench.output.status)
assert "sample 1500" in caught
assert server.rig.volts == 0.0
assert not (target / "broken.npz").exists()
server.control.answer("FAULT interferometer beam_loss_at=none")

# %% [markdown]
# The take ended with an error and the output was parked. No recording was made of it, so that
# nobody takes it for a good one; but all that arrived is in the journal, sample by sample with its
# flag, and `recover` makes a recording of it that keeps the flags. Below it is compared with the
# good take: first 140 nm of memory, since nobody demagnetised before this one; then the fringe.

# %%
broken = open_journal(target / "broken.journal")
counted = broken.read("interferometer")
lost = (counted.flags & Flag.BEAM_LOST).astype(bool)
made = recover(broken.path)
say(f"{counted.n} samples arrived, {lost.sum()} of them flagged, from {np.argmax(lost)} on",
    f"last event: {broken.notes[-2].content['event']}, output {broken.notes[-1].content['output_end']}",
    f"recovered: {', '.join(p.name for p in made)}")  # fmt: skip
again = Recording.open(made[0])

when, x = counted.numbers / RATE, counted.channels["x"]
beside = 1e9 * (x - session["x"])
figure, rows = plt.subplots(2, 1, figsize=(10, 4.4), sharex=True, constrained_layout=True)
for part, colour, label in ((~lost, "0.25", "good"), (lost, "C3", "flagged BEAM_LOST")):
    rows[0].plot(when[part], 1e6 * x[part], color=colour, lw=0.6, label=label)
    rows[1].plot(when[part], beside[part], color=colour, lw=0.6)
rows[0].set(ylabel="x (um)", title="journal of the broken take")
rows[1].set(xlabel="time (s)", ylabel="less the good take (nm)")
rows[0].legend(loc="upper right")
plt.show()

jump = beside[1500:1600].mean() - beside[1400:1500].mean()
print(f"by the good take beside it, {jump:.0f} nm were lost; half a wavelength is 316 nm")
if untouched:
    assert abs(jump - 316.4) < 10
assert np.array_equal(np.flatnonzero(lost), np.arange(1500, SAMPLES))
assert broken.read("output").n == SAMPLES
assert again.n == SAMPLES
assert np.array_equal(flags_of(again, "interferometer") & Flag.BEAM_LOST > 0, lost)

# %% [markdown]
# ## The diagnosis
#
# A linear model of the stack, which knows nothing of all this; its current sensor is removed, since
# this bench measures none. It gets the stored file and nothing else.

# %%
graph = stack_on_bench().remove("i")
data = Recording.open(taken.path).select({"V": "V", "x": "x"})
found = diagnose(
    graph, data, model="stack_on_bench",
    options=DiagnosisOptions(jobs=1, effects=1, keep=6, more=3),  # one effect, few rivals: to be short
)  # fmt: skip
say(sentence(found), *(f"- {r}" for step in found.steps for r in step.reasons),
    *(f"advice: {a}" for a in found.advice), f"{found.seconds:.0f} s")  # fmt: skip

# %% [markdown]
# Before and after. On the left over the voltage, both averaged over 4 ms so that the multisine does
# not hide it: what the linear model misses runs in loops. On the right the stretches that no fit
# has seen.

# %%
answer = found.repaired or found.nominal
held, x = found.data.mask("test"), found.data.readings[:, 0]
begin = int(np.argmax(held | found.data.mask("train")))  # before it the states are still unknown


def averaged(values):
    """Mean of 40 samples."""
    return np.convolve(values[begin:], np.full(40, 1 / 40), "valid")


figure, axes = plt.subplots(1, 2, figsize=(10, 4), constrained_layout=True)
for name, fit, colour in (
    ("model as it is", found.nominal, "C1"),
    ("with what was found", answer, "C0"),
):
    left = 1e9 * (x - fit.simulated[:, 0])
    axes[0].plot(averaged(data["V"]), averaged(left), color=colour, lw=1.0, label=name)
    axes[1].plot(found.data.time, np.where(held, left, np.nan), color=colour, lw=0.8, label=name)
axes[0].set(xlabel="voltage (V)", ylabel="measured less model (nm)", title="what is left, averaged")
axes[1].set(xlabel="time (s)", ylabel="measured less model (nm)", title="what is left, held out")
axes[0].set_ylim(bottom=1.4 * axes[0].get_ylim()[0])
axes[0].legend(loc="lower center", ncols=2)
plt.show()

# %% [markdown]
# Name and place are clear: the memory sits in the spring, no law of another place explains as much,
# and no form of a law would explain more there.
#
# ## The seal is opened

# %%
bench.close()
left = server.rig.volts
envelope = server.envelope
told = envelope.truth()
truth = truth_of(told)
outcome = judge(truth, found)
named = verdict(found)["findings"]
print(f"concealed: {describe(truth)} ({truth.id})")
for f in named:
    also = ", ".join(f["location"]["indistinguishable_from"])
    print(f"found:     {f['effect']} at {f['location']['element']}"
          + (f" ({also} cannot be told from it by these sensors)" if also else ""))  # fmt: skip
print(f"that is:   {outcome.result}")
same = hashlib.sha256(f"{envelope.salt}:{envelope.payload}".encode()).hexdigest() == sealed
print(f"the hash is the one shown before: {same}")

true = server.rig.seen(edges).x
off = session["x"] - (true - true[0])
print(f"stored and true length differ by {1e9 * np.std(off):.2f} nm rms; "
      f"the noise of the sensor is {1e9 * truth.noise['x']:.2f} nm")  # fmt: skip
server.stop()
folder.cleanup()

# %% [markdown]
# With the settings above:

# %%
assert same
assert left == 0.0
if untouched:
    fits = (found.nominal, found.repaired)
    before, after = (normalised_error(f, "held-out")["x"] for f in fits)
    print(f"held-out error {100 * before:.2f} % before, {100 * after:.2f} % after")
    assert found.kind == "missing_physics"
    assert (named[0]["effect"], named[0]["location"]["element"]) == (EFFECT, PLACE)
    assert outcome.result == "right"
    assert before > 0.02
    assert after < 0.1 * before
    assert np.std(off) < 1.1 * truth.noise["x"]
print("ok")

# %% [markdown]
# Now let the bench conceal something that you do not know (`"drawn"`, `None`), or pull the card
# in the middle of a take (`FAULT card gone=1`, from a `watch`). A weak effect may be missed
# in a record of 0.4 s. The same in one line, with a bench in a process of its own:
#
#     bondsight acquire --simulated --diagnose stack_on_bench
