"""How much memory and reading a file may cost: in proportion to its size, whatever it says of itself.

A log of `hall` decompresses to 1.5 times its size, with a record for each 2600 bytes; LZ4 can make 255 bytes of one,
Zstandard a hundred thousand. A message has an index entry of 16 bytes, which no compression makes smaller.
"""

# a constant part, and a part for each byte of the file
FREE_CONTENTS, CONTENTS = 16 * 2**20, 100  # [bytes] of chunks decompressed
FREE_RECORDS, BYTES_A_RECORD = 30_000, 8  # records in chunks; one for so many bytes
FREE_READING, READING = 64 * 2**20, 64  # [bytes] read in search of intact records
FREE_EXPORT, EXPORT = 64 * 2**20, 100  # [bytes] of tables and of a page's columns
LEAST_READ = 512  # [bytes] that a read counts as at least, for what is tried at its place takes time


class Budget:
    """What one reading of a file of `size` bytes may still cost; what is allowed is deducted."""

    def __init__(self, size: int):
        self._contents = FREE_CONTENTS + CONTENTS * size
        self._records = FREE_RECORDS + size // BYTES_A_RECORD
        self._reading = FREE_READING + READING * size
        self._export = FREE_EXPORT + EXPORT * size

    def allows_contents(self, size: int) -> bool:
        """Whether `size` more bytes may be decompressed."""
        if size > self._contents:
            return False
        self._contents -= size
        return True

    def allows_record(self) -> bool:
        """Whether one more record may come out of a chunk."""
        self._records -= 1
        return self._records >= 0

    def allows_reading(self, size: int) -> bool:
        """Whether `size` more bytes may be read in search of intact records."""
        self._reading -= max(size, LEAST_READ)
        return self._reading >= 0

    def allows_export(self, size: int) -> bool:
        """Whether `size` more bytes of tables may be made of it."""
        self._export -= size
        return self._export >= 0
