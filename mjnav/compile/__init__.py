"""Kernels: functions that numba compiles, and the cache on disk of what it compiled."""
