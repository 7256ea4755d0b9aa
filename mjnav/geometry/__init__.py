"""Angles, poses and clearances: plain functions on arrays; and how mjnav compiles such functions."""
