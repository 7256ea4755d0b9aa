"""Comparisons of methods for people and for programs: text, CSV, JSON, LaTeX, HTML.

The tables are written here and not by a library. pandas' Styler and great_tables were tried: neither writes `data-`
attributes or cells of two lines, Styler's imports take 1.7 s of processor time, and great_tables brings 50 MB.
"""
