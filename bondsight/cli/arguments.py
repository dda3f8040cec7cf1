"""Types of command-line arguments, with one-line refusals."""

from __future__ import annotations

import argparse


def jobs(text: str) -> int:
    """Return a number of processes, not 0."""
    try:
        value = int(text)
    except ValueError:
        value = 0
    if value == 0:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of processes; -1 is all cores")
    return value


def nonnegative(text: str) -> int:
    """Return a whole number of at least 0, such as a seed."""
    try:
        value = int(text)
    except ValueError:
        value = -1
    if value < 0:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number of at least 0")
    return value
