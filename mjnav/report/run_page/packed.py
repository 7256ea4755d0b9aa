"""Arrays in a page: compact text that a few lines of JavaScript turn back into numbers.

Measured columns are whole multiples of a step, as 16-bit codes of their change from row to row; what moves smoothly
becomes small codes, low and high bytes stand apart, and gzip packs that well. The inverse is web/unpack.js.
"""

import gzip
from base64 import b64encode
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

_MAX_CODE = 65534  # of a 16-bit code; the next is NaN
_MAX_OFFSET = 127  # of a signed byte; -128 is NaN
LARGEST = 1e100  # of a measured number: differences of such are finite, too
_ALIGNMENT = 8  # [bytes] so that every array begins where doubles may


class Packer:
    """Collects named arrays whose first axis is time; `packed` is the document for the page."""

    def __init__(self):
        self._fields: dict[str, dict[str, Any]] = {}
        self._data: list[bytes] = []
        self._size = 0

    def measured(self, name: str, values: ArrayLike, step: float) -> None:
        """Numbers (T, ...) to the nearest multiple of `step`, or of what their range needs; NaN is kept.

        What is beyond LARGEST is NaN, too: nothing that was measured.
        """
        values = np.asarray(values, float)
        known = np.abs(values) <= LARGEST
        low, high = (values[known].min(), values[known].max()) if known.any() else (0.0, 0.0)
        step = max(step, (high - low) / (_MAX_CODE - 1))
        low = np.floor(low / step) * step
        codes = np.full(values.shape, _MAX_CODE + 1)
        codes[known] = np.rint((values[known] - low) / step)
        columns = codes.reshape(len(codes), -1).T
        change = np.diff(columns, axis=1, prepend=0).astype(np.uint16)  # modulo 2^16, as the page's sum is
        planes = np.stack([change & 0xFF, change >> 8]).astype(np.uint8)
        self._add(name, planes, "measured", values.shape, low=float(low), step=float(step))

    def offsets(self, name: str, values: ArrayLike, step: float) -> None:
        """Small numbers (T, ...) about zero, a byte each; what is beyond 127 steps is brought to it, NaN is kept."""
        values = np.asarray(values, float)
        known = np.isfinite(values)
        codes = np.full(values.shape, -_MAX_OFFSET - 1)
        codes[known] = np.clip(np.rint(values[known] / step), -_MAX_OFFSET, _MAX_OFFSET)
        self._add(name, codes.astype(np.int8), "offsets", values.shape, step=step)

    def numbers(self, name: str, values: NDArray[np.uint8] | NDArray[np.float32] | NDArray[np.float64]) -> None:
        """Numbers (T, ...) as they are."""
        self._add(name, values, values.dtype.name, values.shape)

    def _add(self, name: str, data: np.ndarray, kind: str, shape: tuple[int, ...], **more: float) -> None:
        content = np.ascontiguousarray(data, data.dtype.newbyteorder("<")).tobytes()
        content += bytes(-len(content) % _ALIGNMENT)
        self._fields[name] = {"kind": kind, "shape": list(shape), "offset": self._size, **more}
        self._data.append(content)
        self._size += len(content)

    def packed(self) -> dict[str, Any]:
        """Each array's kind, shape and place, and all of them as base64 of gzip."""
        data = gzip.compress(b"".join(self._data), 9, mtime=0)
        return {"fields": self._fields, "gzip": b64encode(data).decode()}
