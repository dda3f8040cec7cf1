"""What is timed, beside peers: by ``bondsight bench``, or ``python -m tests.benchmarks.NAME``.

No test asserts on time. A module with a bound prints its numbers in `main` and returns 1 beyond it,
on an idle machine.
"""
