"""Comparisons of methods for people and for programs: text, CSV, JSON, LaTeX, HTML."""
