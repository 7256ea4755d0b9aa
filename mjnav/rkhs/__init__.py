"""The idea: distributions embedded in a reproducing kernel Hilbert space, and the distance between them."""

from mjnav.rkhs.mmd import PolynomialKernel, mmd_squared, moment_distance, raw_moments

__all__ = ["PolynomialKernel", "mmd_squared", "moment_distance", "raw_moments"]
