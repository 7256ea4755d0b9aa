"""Copies of a simulation's state."""

from collections.abc import Iterable, Mapping
from copy import deepcopy
from typing import Any

from mjnav.errors import InputError, MjnavError


def branched(state: Mapping[str, Any], messages: Iterable[object]) -> dict[str, Any]:
    """A deep copy of a simulation's parts by name, which shares `messages`: they never change.

    Raises InputError where an object of the user's own cannot be copied.
    """
    try:
        return deepcopy(dict(state), {id(message): message for message in messages})
    except MjnavError:
        raise
    except Exception as error:
        raise InputError(
            f"copy(): {type(error).__name__}: {error}; objects of your own in a simulation need to be ones that "
            "copy.deepcopy can copy, or have a method __deepcopy__"
        ) from error
