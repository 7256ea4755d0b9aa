"""One-line texts of objects that hold arrays: their shapes in place of thousands of numbers."""

from collections.abc import Iterator, Mapping
from dataclasses import fields
from enum import StrEnum
from typing import Any

import numpy as np

MAX_SHOWN = 6  # numbers of an array that is shown in full
MAX_TEXT = 60  # characters of a value


class ShortRepr:
    """A dataclass whose repr is one line: short arrays in full, the shape of others, the number of what a tuple holds.

    The dataclass is made with `repr=False`.
    """

    __slots__ = ()

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(_parts(self))})"


def _parts(instance: Any) -> Iterator[str]:
    for field in fields(instance):
        value = getattr(instance, field.name)
        if field.repr and value is not None and not (isinstance(value, tuple) and not value):
            yield f"{field.name}={_short(value)}"


def _short(value: Any) -> str:
    match value:
        case np.ndarray() if value.size <= MAX_SHOWN:
            return np.array2string(value, precision=3, suppress_small=True, separator=", ").replace("\n", "")
        case np.ndarray():
            return f"<{' x '.join(map(str, value.shape))}>"
        case StrEnum():
            return str(value)
        case float():
            text = f"{value:.4g}"
        case tuple() | list() if len(value) > MAX_SHOWN or any(hasattr(item, "__dataclass_fields__") for item in value):
            return f"<{len(value)}>"
        case Mapping():
            return f"<{len(value)}>"
        case ShortRepr():
            return f"<{type(value).__name__}>"
        case _:
            text = repr(value)
    return text if len(text) <= MAX_TEXT else f"{text[: MAX_TEXT - 3]}..."
