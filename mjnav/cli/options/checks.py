"""Checks of options that the parser cannot make. They raise InputError."""

from mjnav.errors import InputError, InvalidValue


def check_needs(option: str, needed: str, *, given: bool, met: bool) -> None:
    """An option that was given has what it needs: `--port needs --live`."""
    if given and not met:
        raise InputError(f"{option} needs {needed}")


def check_whole(option: str, value: int, low: int, high: int | None = None) -> None:
    """A whole number is in its range."""
    if value < low or (high is not None and value > high):
        allowed = f"a whole number >= {low}" if high is None else f"a whole number from {low} to {high}"
        raise InvalidValue(option, value, allowed)
