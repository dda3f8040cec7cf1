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
# # The thesis in one hour
#
# The measurement of the stack actuator thesis, on your own stack: ramps and sines are recorded,
# T, k, remanence and the operator of the hysteresis are found, the complete model is held against
# a recording that it has not seen, the compensating voltage is computed, and the loop is measured
# before and after. Every step is a command, and is printed as you would type it.
#
# The stack stands on the virtual bench, whose devices answer with their real bytes (`gcc` is
# needed). **All data are simulated**, by equations that share no code with the models.

# %%
import os
import shlex
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np
from threadpoolctl import threadpool_limits

from actuators.compensation import loop_thickness
from actuators.stack.identified import IdentifiedStack
from bondgraph import Recording
from bondsight.cli.bench_serve import station_writer
from bondsight.cli.main import main
from hardware.simulators.bench_server import BenchServer
from hardware.simulators.bench_server.config import config_from
from hardware.simulators.plants import conceal

threadpool_limits(1)  # small matrices: threads would only wait for each other
# %matplotlib inline
# %config InlineBackend.figure_formats = ['png']
plt.rcParams.update({"figure.dpi": 90, "axes.grid": True, "grid.alpha": 0.3})

os.environ["BONDSIGHT_BENCH_SIOS_TIMEOUT"] = "60"  # s; a busy machine may be slow
started = Path.cwd()
scratch = TemporaryDirectory()
os.chdir(scratch.name)
LEFT_OUT = ("envelope", "signal", "raw data", "output", "note:", "recording")


def bondsight(command):
    """Run a command and print it, with what it says of results."""
    print(f"$ bondsight {command}")
    said = StringIO()
    with redirect_stdout(said):
        code = main([*shlex.split(command), *(["--quiet"] if command.startswith("acq") else [])])
    assert code == 0, said.getvalue()
    told = [line for line in said.getvalue().splitlines() if not line.startswith(LEFT_OUT)]
    print("\n".join(told) + "\n" if told else "", end="")
    return "\n".join(told)


def numbers(said, row):
    """Return the numbers in a row of a printed table."""
    line = next(line for line in said.splitlines() if line.strip().startswith(row))
    words = line.split(row, 1)[1].replace("%", " ").split()
    return [float(w) for w in words if w.replace(".", "", 1).isdigit()]


# %% [markdown]
# ## A stack that is in no model
#
# Its constants are drawn. Its hysteresis is nine plays before the dielectric, so neither
# Al Janaideh's operator nor Ang's is the truth; it creeps behind them, the interferometer has
# 2 nm of noise and a clock of its own. `bondsight bench serve --config FILE --station station.toml`
# makes such a bench outside of a notebook.

# %%
SEED, NOISE = 31, 2e-9
PLANT = {
    "seed": SEED, "effect": "none", "noise_x": NOISE,
    "play_radii": [1.5, 4.0, 7.0, 11.0, 16.0, 22.0, 29.0, 37.0, 46.0],
    "play_gains": [0.10, 0.07, 0.055, 0.05, 0.04, 0.04, 0.03, 0.03, 0.025],
    "creep_ratios": [0.02, 0.02], "creep_times": [0.04, 0.4],
}  # fmt: skip
BENCH = {"plant": PLANT, "interferometer": {"ppm": 35.0, "jitter": 20e-9}}


def served(bench):
    """Start a bench and write its station file."""
    config = config_from(bench)
    server = BenchServer(config)
    server.start()
    station_writer(Path("station.toml"), config)(server.addresses)
    return server


# %% [markdown]
# ## k first
#
# What a free ramp tells is T / k. The other number needs a force: here somebody presses a force
# gauge against the stack, with up to 4 N, while the voltage is held. Without a gauge put a known
# mass on it (`--weight`), take the ringing of a known mass (`--step`, `--mass`), or give k.

# %%
press = PLANT | {"press": [4.0, 2.0]}
fronts = ["interferometer", "card", "gauge"]
server = served(BENCH | {"plant": press, "fronts": fronts})
bondsight("acquire station.toml --signal hold:5:0 --rate 1000 --name pressed")
server.stop()

# %% [markdown]
# ## Ramps and sines
#
# From rest at 0 V, each with a moment of rest before it. The first one also is the loading curve of
# a stack that has seen nothing. The fourth one is of another kind, beats, and is not fitted.

# %%
time = np.arange(2500) / 1e3
beats = 0.5 * (1 - np.cos(2 * np.pi * 1.7 * time)) * (55 + 35 * np.sin(2 * np.pi * 0.6 * time))
Recording("beats", time, {"V": beats}, {"V": "V"}).save(Path("beats.npz"))

server = served(BENCH)
for name, signal in (
    ("loading", "triangle:0.25 --samples 4000 --rate 1000"),
    ("loops", "sine:2 --samples 1500 --rate 1000"),
    ("held", "sine:1:0:80 --samples 1500 --rate 1000"),
    ("fresh", "beats.npz"),
):
    bondsight(f"acquire station.toml --signal {signal} --rest 0.2 --name {name}")
    server.control.answer("WAIT 3")  # a person takes a while from one take to the next

# %% [markdown]
# ## T, k, remanence, operator, complete model
#
# Both operators are fitted in all their numbers and several sizes; the last record, which the fits
# do not see, chooses. The complete model is the lumped stack with that operator as its hysteresis.

# %%
found = bondsight(
    "stack identify bondsight-out/loading.npz bondsight-out/loops.npz bondsight-out/held.npz "
    "--load bondsight-out/pressed.npz --validate bondsight-out/fresh.npz --plays 10 14 "
    "--out stack.json"
)
stack = IdentifiedStack.open(Path("stack.json"))

# %% [markdown]
# ## Back as compensation
#
# The target is that of the thesis, (7.3) at 1 Hz. Played are the voltage of a plain gain, the one
# of the inverse, and then the loop is closed: PI behind the inverse.

# %%
after = bondsight(
    "compensate stack.json --target thesis --rate 1000 --station station.toml --closed 1000 "
    "--out voltage.npz"
)
server.stop()

# %%
runs = {
    "plain gain": Recording.open(Path("bench-plain-gain.npz")),
    "inverse": Recording.open(Path("bench-inverse.npz")),
    "PI + inverse": Recording.open(Path("bench-closed.npz")),
}
wanted = np.asarray(Recording.open(Path("voltage.npz"))["x_ref"])
paths = {}
for name, run in runs.items():
    x = np.asarray(run["x"])
    rest = x.size - wanted.size
    paths[name] = x[rest:] - (x[:rest].mean() if rest else 0.0)

figure, axes = plt.subplots(1, 2, figsize=(10, 3.8), constrained_layout=True)
fresh = Recording.open(Path("bondsight-out/fresh.npz"))
axes[0].plot(fresh["V"], 1e6 * np.asarray(fresh["x"]), lw=0.7, color="0.3")
axes[0].set(xlabel="voltage (V)", ylabel="length (um)", title="the record that no fit has seen")
for (name, x), colour in zip(paths.items(), ("C1", "C0", "C2"), strict=True):
    axes[1].plot(1e6 * wanted, 1e9 * (x - wanted), lw=0.7, color=colour, label=name)
axes[1].set(xlabel="wanted (um)", ylabel="measured less wanted (nm)", title="before and after")
axes[1].legend(loc="center", bbox_to_anchor=(0.64, 0.72))
plt.show()

# %% [markdown]
# ## Beside the thesis
#
# The loop of the closed run is measured after a mean of 21 samples (21 ms of a period of 1 s): at
# two nanometres of noise, single samples of two branches differ by more than the branches.

# %%
truth = conceal(SEED, "none").case.parameters
k, T = truth["k"], truth["alpha"]
span = float(np.ptp(wanted))


def thickness(x, width=1):
    """Return the loop of a run over its target (nm), after a mean of some samples."""
    error = np.convolve(x - wanted, np.full(width, 1 / width), "same")
    return 1e9 * loop_thickness(wanted, wanted + error)


complete = numbers(found, "complete model: lumped + operator")
plain, opened, closed = (
    numbers(after, f"bench, {row}") for row in ("plain gain", "inverse", "PI + inverse")
)
rows = [
    ("k (N/um)", 1e-6 * k, 1e-6 * stack.stiffness.value, "65"),
    ("T (N/V)", T, stack.transducer.value, "3.52"),
    ("remanence (nm)", float("nan"), 1e9 * stack.remanence.value, "about 500"),
    ("operator, rms (nm)", 1e9 * NOISE, 1e9 * stack.rms, "28.63"),
    ("complete model, fresh record (nm)", 1e9 * NOISE, complete[0], "87.36 (fitted)"),
    ("  of its range (%)", float("nan"), complete[1], "1.8"),
    ("loop, plain gain (nm)", float("nan"), thickness(paths["plain gain"]), "770"),
    ("loop, inverse (nm)", float("nan"), thickness(paths["inverse"]), "110"),
    ("  of the target's range (%)", float("nan"), opened[4], "< 4"),
    ("closed at 1 Hz, rms (%)", float("nan"), closed[1], "-"),
    ("closed at 1 Hz, loop (nm)", float("nan"), thickness(paths["PI + inverse"], 21), "-"),
]
print(f"{'':36s}{'truth, noise':>13s}{'found':>10s}   thesis")
for what, true, here, printed in rows:
    print(f"{what:36s}{'' if np.isnan(true) else f'{true:.4g}':>13s}{here:10.4g}   {printed}")

# %% [markdown]
# With the settings above:

# %%
assert abs(stack.transducer.value / T - 1) < 0.02
assert abs(stack.stiffness.value / k - 1) < 0.02
assert stack.rms < 2 * NOISE
assert complete[1] < 1.0
assert plain[4] > 5.0
assert max(opened[1], opened[4]) < 1.0
assert closed[1] < 0.1
assert thickness(paths["PI + inverse"], 21) < 1e-3 * 1e9 * span
os.chdir(started)
scratch.cleanup()
print("ok")

# %% [markdown]
# On your own bench only the station file differs. The same takes, at the thesis' own rate, and what
# each option means: page *The actuators* of the documentation.
