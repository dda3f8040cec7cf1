"""Devices of public identification benchmarks as bond graphs, one file a device."""
