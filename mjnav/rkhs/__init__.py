"""The idea: distributions embedded in a reproducing kernel Hilbert space, and the distance between them."""

from mjnav.rkhs.mmd import mmd_squared

__all__ = ["mmd_squared"]
