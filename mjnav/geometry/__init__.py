"""Angles, poses and clearances: plain functions on arrays."""
