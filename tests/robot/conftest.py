"""The rooms of the loop's tests."""

from tests.loop.conftest import empty, room

__all__ = ["empty", "room"]
