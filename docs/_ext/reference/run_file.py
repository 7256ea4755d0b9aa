"""Every key of run files, from the same rows as `mjnav keys`."""

from mjnav.study.key_reference import run_keys

from .keys import by_table


def markdown() -> str:
    """A table for each table of the file."""
    return by_table(run_keys())
