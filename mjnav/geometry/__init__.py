"""Angles, poses, clearances and ways: plain functions on arrays."""
