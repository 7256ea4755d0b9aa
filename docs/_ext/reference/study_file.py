"""Every key of study files, from the same rows as `mjnav keys --study`."""

from mjnav.study.key_reference import study_keys

from .keys import by_table


def markdown() -> str:
    """A table for each table of the file."""
    return by_table(study_keys())
