"""Import of a floor that others drew: the tables of a run file for a map of ROS map_server or a world of Gazebo."""

import os
from pathlib import Path
from typing import Any

from mjnav.errors import InvalidValue
from mjnav.printable import printable
from mjnav.scene.toml import read_regular, readable
from mjnav.scene.world_file import read_world

MAPS, WORLDS = (".yaml", ".yml"), (".world", ".sdf")
FLOORS = MAPS + WORLDS
_MAX_BYTES = 20_000_000  # of a world


def floor_tables(file: str, folder: Path) -> tuple[dict[str, Any], list[str]]:
    """The tables of a run file in `folder`, without a robot, and what of a world is left out. Raises InvalidValue.

    Of a map they only name the file.
    """
    name = printable(Path(file).stem)
    if file.endswith(MAPS):
        relative = file if os.path.isabs(file) else os.path.relpath(file, folder)
        return {"schema": 1, "name": name, "map": {"file": relative}}, []
    with readable("a world", file=file):
        data = read_regular(file, _MAX_BYTES)
    try:
        world = read_world(data)
    except InvalidValue as error:
        raise error.within(file=file) from None
    bodies = {"pillars": world.pillars, "walls": world.walls}
    return {"schema": 1, "name": name, **{key: found for key, found in bodies.items() if found}}, world.left_out
