"""The Foxglove layout that every log carries and the package ships: import it to see the run at once.

A 3-D view that follows the robot, plots of its motion, estimate and timing, and the events.
"""

from pathlib import Path

LAYOUT = Path(__file__).with_name("foxglove-layout.json")


def foxglove_layout() -> bytes:
    """The file as it is."""
    return LAYOUT.read_bytes()
