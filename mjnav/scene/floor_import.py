"""A floor that others drew: the tables of a run file for a map of ROS map_server, or for a world of Gazebo.

Of a world, the cylinders and boxes of the static models in an SDF file become pillars and walls.

A pose "x y z roll pitch yaw" counts from the element around it: world, model, model in a model, link, collision
(SDFormat, "Pose semantics", without frames by name). Where the world has a <state>, its models stand as that says.
Planes are the floor. All else that is solid is left out and named.
"""

import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from math import cos, isfinite, pi, sin
from pathlib import Path
from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from mjnav.errors import InvalidValue
from mjnav.printable import printable
from mjnav.scene.ranges import MIN_SIZE
from mjnav.scene.toml import read_regular, readable
from mjnav.settings import below

OVERHEAD = 2.0  # [m] above the floor: what begins higher is out of everybody's way
THICK = 0.2  # [m]; a box that is wider on both sides is the four walls along its sides
_UPRIGHT = 1e-6  # [rad] of roll and pitch
_PLACES = 9  # [decimals of a metre]
_MAX_DEPTH = 20  # models in one another
_SOLIDS = ("cylinder", "box")

Pose = tuple[float, float, float, float]  # x, y, z [m], yaw [rad]


class Unread(ValueError):
    """A part of a world that is left out; the message says why."""


@dataclass(slots=True)
class World:
    """What stands in a world, as tables of a run file; and what does not, named."""

    pillars: list[dict[str, Any]] = field(default_factory=list)
    walls: list[dict[str, Any]] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)


class _Tree(ElementTree.TreeBuilder):
    def doctype(self, name: str, pubid: str | None, system: str | None) -> None:
        """Raises InvalidValue before an entity is declared: one that stands for others could fill the memory."""
        raise InvalidValue("", "a DOCTYPE", "SDF, which has none")


def read_world(data: bytes) -> World:
    """The world in the bytes of an SDF file. Raises InvalidValue."""
    try:
        root = ElementTree.fromstring(data, ElementTree.XMLParser(target=_Tree()))
    except ElementTree.ParseError as error:
        raise InvalidValue("", None, f"XML ({error})") from None
    except (LookupError, ValueError) as error:
        if isinstance(error, InvalidValue):
            raise
        raise InvalidValue("", None, f"XML in an encoding that can be read ({error})") from None
    world = root.find("world")
    if root.tag != "sdf" or world is None:
        raise InvalidValue("", f"<{root.tag}>", "SDF: <sdf> with a <world>")
    found = World()
    state = world.find("state")
    saved = {} if state is None else {model.get("name"): model.find("pose") for model in state.findall("model")}
    for include in world.iter("include"):
        found.left_out.append(f"{include.findtext('uri', 'an include').strip()}: another file")
    for model in world.findall("model"):
        _add_model(found, model, (0.0, 0.0, 0.0, 0.0), "", saved.get(model.get("name")), 0)
    return found


def _add_model(found: World, model: Element, around: Pose, outer: str, saved: Element | None, depth: int) -> None:
    """The static collision geometries of a model, and of the models in it."""
    name = f"{outer}{model.get('name', 'a model')}"
    if not outer and model.findtext("static", "0").strip() not in ("1", "true"):
        found.left_out.append(f"{name}: it is not static")
        return
    if depth > _MAX_DEPTH:
        raise InvalidValue(name, depth, f"at most {_MAX_DEPTH} models in one another")
    try:
        pose = _within(around, model.find("pose") if saved is None else saved)
    except Unread as reason:
        found.left_out.append(f"{name}: {reason}")
        return
    for link in model.findall("link"):
        for collision in link.findall("collision"):
            try:
                place = _within(_within(pose, link.find("pose")), collision.find("pose"))
                _add_solid(found, collision.find("geometry"), place)
            except Unread as reason:
                found.left_out.append(f"{name}: {reason}")
    for inner in model.findall("model"):
        _add_model(found, inner, pose, f"{name}/", None, depth + 1)


def _within(around: Pose, element: Element | None) -> Pose:
    """A pose element's, of which `around` is the frame. Raises Unread."""
    if element is None or not (element.text or "").strip():
        return around
    frame = element.get("relative_to") or element.get("frame")
    if frame or element.get("rotation_format", "euler_rpy") != "euler_rpy":
        raise Unread(f"a pose in the frame {frame!r}" if frame else "a pose that is not x y z roll pitch yaw")
    x, y, z, *angles = _numbers(element, 6)
    roll, pitch, yaw = (pi / 180.0 * a for a in angles) if element.get("degrees") in ("1", "true") else angles
    if max(abs(sin(roll)), abs(sin(pitch))) > _UPRIGHT or cos(roll) < 0.0 or cos(pitch) < 0.0:
        raise Unread("a pose that is not upright")
    c, s = cos(around[3]), sin(around[3])
    return around[0] + c * x - s * y, around[1] + s * x + c * y, around[2] + z, around[3] + yaw


def _numbers(element: Element, count: int) -> list[float]:
    words = (element.text or "").split()
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(map(isfinite, numbers)):
        raise Unread(f"<{element.tag}>{' '.join(words)}</{element.tag}> in place of {count} finite numbers")
    return numbers


def _add_solid(found: World, geometry: Element | None, pose: Pose) -> None:
    """A collision geometry where it stands. Raises Unread for what is neither cylinder, box nor floor."""
    if geometry is None or not len(geometry):
        raise Unread("a collision without geometry")
    kind = geometry[0]
    if kind.tag == "plane":
        return
    if kind.tag not in _SOLIDS:
        raise Unread(f"a {kind.tag}, neither a cylinder nor a box")
    lengths = ("radius", "length") if kind.tag == "cylinder" else ("size",)
    sizes = [value for key in lengths for value in _size(kind, key, 3 if key == "size" else 1)]
    x, y, z, yaw = pose
    if z - 0.5 * sizes[-1] >= OVERHEAD:
        raise Unread(f"a {kind.tag} {z - 0.5 * sizes[-1]:g} m above the floor")
    height = round(z + 0.5 * sizes[-1], _PLACES)
    if height < MIN_SIZE:
        return  # within the floor
    if kind.tag == "cylinder":
        at = [round(x, _PLACES), round(y, _PLACES)]
        found.pillars.append({"position": at, "radius": sizes[0], "height": height})
    else:
        sides = box_walls((x, y), (cos(yaw), sin(yaw)), (sizes[0], sizes[1]))
        found.walls.extend({**wall, "height": height} for wall in sides)


def _size(kind: Element, key: str, count: int) -> list[float]:
    element = kind.find(key)
    numbers = [] if element is None else _numbers(element, count)
    if not numbers or min(numbers) < MIN_SIZE:
        raise Unread(f"a {kind.tag} whose {key} is not at least {MIN_SIZE:g} m")
    return numbers


def box_walls(
    centre: tuple[float, float], along: tuple[float, float], size: tuple[float, float]
) -> Iterator[dict[str, Any]]:
    """A rectangle as tables of `walls`: one along it, or where it is THICK the four along its sides, within it.

    `along` is the unit vector of its first side; `size` holds both sides [m]. A controller takes one face of a wall, as
    much longer than the wall as the wall is thick: too much for a block.
    """
    (a, b), (c, s) = size, along
    if min(a, b) > THICK:
        t = 0.25 * THICK
        shift = 0.5 * (b - t)
        for sign in (-1.0, 1.0):
            beside = (centre[0] - sign * shift * s, centre[1] + sign * shift * c)
            yield from box_walls(beside, along, (a, t))
            beside = (centre[0] + sign * 0.5 * (a - t) * c, centre[1] + sign * 0.5 * (a - t) * s)
            yield from box_walls(beside, along, (t, b - 2.0 * t))
        return
    c, s, half, thickness = (c, s, 0.5 * a, b) if a >= b else (-s, c, 0.5 * b, a)
    ends = [[round(centre[0] + e * c, _PLACES), round(centre[1] + e * s, _PLACES)] for e in (-half, half)]
    yield {"from": ends[0], "to": ends[1], "thickness": round(thickness, _PLACES)}


# ----------------------------------------------------------------------------------- a map or a world


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
    with below(file=file):
        world = read_world(data)
    bodies = {"pillars": world.pillars, "walls": world.walls}
    return {"schema": 1, "name": name, **{key: found for key, found in bodies.items() if found}}, world.left_out
