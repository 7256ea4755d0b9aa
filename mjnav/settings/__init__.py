"""What the keys of a file may hold, said once at the fields of a dataclass: read, checked, written and described.

    @dataclass(frozen=True, slots=True)
    class Sensors(Settled):
        rate: Annotated[float, Range(0.1, 1000.0, "Hz"), "of odometry, gyro and detections"] = 10.0

A dataclass below `Settled` checks itself, also where Python code makes it (`settle` does that in a `__post_init__`).
`read` makes one of a TOML table, `tables` writes it back, and `json_schema` describes the table to editors. Run files,
study files, controllers' parameters and noise all go this way.

Own code, because a refusal says key, value, range and nearest name: msgspec 0.22 (40 ms to import) gives no value and
one side of a range only, and ignores unknown keys of dataclasses; pydantic 2.14 takes 210 ms to import.
"""

from mjnav.settings.marks import Beside, Choice, Key, Length, Named, Range, Text, Variants
from mjnav.settings.table import Settled, below, keys, read, read_document, settle, settled, tables

__all__ = [
    "Beside",
    "Choice",
    "Key",
    "Length",
    "Named",
    "Range",
    "Settled",
    "Text",
    "Variants",
    "below",
    "keys",
    "read",
    "read_document",
    "settle",
    "settled",
    "tables",
]
