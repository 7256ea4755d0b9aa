"""How much may be made of a file: in proportion to its size, and no more, whatever it says of itself.

A log of `hall` holds 1.5 bytes for each of its own, and a record for each 2600 of them; LZ4 can make 255 bytes of one,
Zstandard a hundred thousand. A message has an index entry of 16 bytes, which no compression makes smaller.
"""

FREE_CONTENTS, CONTENTS = 16 * 2**20, 100  # [bytes] of chunks decompressed: so many, and so many for each of the file
FREE_RECORDS, BYTES_A_RECORD = 30_000, 8  # inside chunks: so many, and one for so many bytes of the file
FREE_READING, READING = 64 * 2**20, 64  # [bytes] read in search of what is intact, and so many for each of the file
FREE_EXPORT, EXPORT = 64 * 2**20, 100  # [bytes] of tables: so many, and so many for each of the file
LEAST_READ = 512  # [bytes] that a read counts as at least: what is tried at its place takes time, too


class Budget:
    """Of one reading of a file of `size` bytes."""

    def __init__(self, size: int):
        self._contents = FREE_CONTENTS + CONTENTS * size
        self._records = FREE_RECORDS + size // BYTES_A_RECORD
        self._reading = FREE_READING + READING * size
        self._export = FREE_EXPORT + EXPORT * size

    def allows_contents(self, size: int) -> bool:
        """Whether so many bytes more may be decompressed; then they are taken off."""
        if size > self._contents:
            return False
        self._contents -= size
        return True

    def allows_record(self) -> bool:
        """Whether one more record may come out of a chunk; then it is taken off."""
        self._records -= 1
        return self._records >= 0

    def allows_reading(self, size: int) -> bool:
        """Whether so many bytes more may be read again; then they are taken off."""
        self._reading -= max(size, LEAST_READ)
        return self._reading >= 0

    def allows_export(self, size: int) -> bool:
        """Whether so many bytes more may be written of it as text; then they are taken off."""
        self._export -= size
        return self._export >= 0
