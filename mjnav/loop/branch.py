"""Copies of a simulation's state."""

from collections.abc import Iterable, Mapping
from copy import deepcopy
from typing import Any

from mjnav.errors import InputError, MjnavError, own_code, said


def branched(state: Mapping[str, Any], messages: Iterable[object]) -> dict[str, Any]:
    """A deep copy of a simulation's parts by name, which shares `messages`: they never change.

    Raises InputError where an object of the user's own cannot be copied.
    """
    advice = (
        "objects of your own in a simulation need to be ones that copy.deepcopy can copy, or have a method __deepcopy__"
    )
    with own_code(lambda error: InputError(f"copy(): {said(error)}; {advice}"), MjnavError):
        return deepcopy(dict(state), {id(message): message for message in messages})
