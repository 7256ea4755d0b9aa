"""Maps of ROS map_server: the table [map] of a run file, and a map of a scene for other tools.

A map is a picture and a YAML file beside it. With x the mean of a pixel's colours, 0 to 255, its occupancy is
p = (255 - x) / 255, or x / 255 with `negate` (ROS wiki, map_server). By mode:

* trinary: p > occupied_thresh is occupied, p < free_thresh free, all else unknown;
* scale: the same, but what lies between the thresholds is a cost of a free place;
* raw: p = x / 100 as it stands, 255 - x in place of x with `negate`; above 1 it is unknown.

A pixel that is quite transparent is unknown. `origin` is the pose of the lower left corner of the lower left pixel.

Loading a run file puts walls in place of the map: rectangles that cover exactly those blocked cells that have a cell
among their eight neighbours that is not blocked. The inside of what is solid, which nothing reaches, stays empty. So
a log has all walls, and a replay needs no map.
"""

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from math import ceil, cos, floor, sin
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from mjnav.errors import InvalidValue
from mjnav.geometry.floor import Floor
from mjnav.messages import Array
from mjnav.scene import toml as files
from mjnav.scene.ranges import MAX_WALLS, MIN_SIZE, Angle, Coordinate, Point, Size
from mjnav.settings import Choice, Range, Settled, below, read, settled

MAX_SIDE = 4096  # cells along each side: 200 m at 5 cm
_MAX_BYTES = 70_000_000  # of a picture: the largest map as the longest text
_MAX_TEXT = 100_000  # bytes of a YAML file
FREE, OCCUPIED, UNKNOWN = 0, 100, -1  # as in nav_msgs/OccupancyGrid
_PLACES = 9  # [decimals of a metre]
_FORMATS = ("PPM", "PNG", "BMP")
Share = Annotated[float, Range(0.0, 1.0)]


@dataclass(frozen=True, slots=True)
class MapFile(Settled):
    """A map of ROS map_server; its walls stand behind those of `walls`, and in the resolved scene among them."""

    file: Annotated[str, "the YAML file, from the run file's folder or else the working folder"]
    unknown: Annotated[
        str,
        Choice(("blocked", "free")),
        "what unknown cells are; where they are blocked, so is all beyond the map; free ones cost route.unknown",
    ] = "blocked"
    height: Annotated[Size, "of its walls above the floor"] = 1.0


@dataclass(frozen=True, slots=True)
class MapInfo(Settled):
    """The YAML file of a map."""

    image: Annotated[str, "the picture, from the YAML file's folder"]
    resolution: Annotated[float, Range(MIN_SIZE, 100.0, "m"), "side of a cell"]
    origin: Annotated[tuple[Coordinate, Coordinate, Angle], "x, y and yaw of the lower left corner"]
    negate: Annotated[int, Range(0, 1), "1: white is occupied"] = 0
    occupied_thresh: Annotated[Share, "occupied above it"] = 0.65
    free_thresh: Annotated[Share, "free below it"] = 0.196
    mode: Annotated[str, Choice(("trinary", "scale", "raw")), "how colours are read"] = "trinary"

    def _check(self):
        if self.free_thresh > self.occupied_thresh:
            raise InvalidValue("free_thresh", self.free_thresh, f"at most occupied_thresh, {self.occupied_thresh:g}")


@dataclass(frozen=True, slots=True, eq=False)
class OccupancyGrid:
    """Cells as FREE, OCCUPIED or UNKNOWN; row 0 is the lowest, as y counts, and `info` says where they lie."""

    info: MapInfo
    cells: NDArray[np.int8]  # (rows, columns)

    def cell_of(self, point: Point) -> int:
        """The cell at a point [m]; UNKNOWN beyond the map."""
        x0, y0, yaw = self.info.origin
        x, y, c, s = point[0] - x0, point[1] - y0, cos(yaw), sin(yaw)
        column, row = floor((c * x + s * y) / self.info.resolution), floor((c * y - s * x) / self.info.resolution)
        rows, columns = self.cells.shape
        return int(self.cells[row, column]) if 0 <= row < rows and 0 <= column < columns else UNKNOWN


# ------------------------------------------------------------------------------------------ reading


def read_map(path: str | os.PathLike[str]) -> OccupancyGrid:
    """The map of a YAML file. Raises InvalidValue with the file and its key."""
    file = os.fspath(path)
    with below(file=file):
        info = read(MapInfo, _flat_yaml(_content(file, _MAX_TEXT, "a YAML file of map_server")))
        data = _content(os.path.join(os.path.dirname(file), info.image), _MAX_BYTES, "a picture", "image")
        with below("image"):
            grey = _grey(data, info.image)
    return _grid(info, *grey)


def _content(path: str, limit: int, what: str, key: str = "") -> bytes:
    with files.readable(what, key, path if key else None):
        return files.read_regular(path, limit)


def _flat_yaml(data: bytes) -> dict[str, Any]:
    """Lines of `key: value`: numbers, words, and arrays of numbers in brackets or as lines of `- value`."""
    found: dict[str, Any] = {}
    try:
        lines = data.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise InvalidValue("", data[error.start : error.end], "text in UTF-8") from None
    key = ""
    for number, line in enumerate(lines, start=1):
        line = re.sub(r"""("[^"]*"|'[^']*')|(?:^|\s)#.*""", r"\1", line).strip()
        item, array = re.fullmatch(r"-\s+(.*)", line), found.get(key)
        if line in ("", "---", "..."):
            continue
        if item is not None and isinstance(array, list):
            array.append(_value(item[1]))
            continue
        pair = re.fullmatch(r"(\w+)\s*:(?:\s+(.*))?", line)
        if pair is None or pair[1] in found:
            raise InvalidValue(f"line {number}", line, "one `key: value` a line, each key once")
        key, text = pair[1], (pair[2] or "").strip()
        listed = re.fullmatch(r"\[(.*)\]", text)
        found[key] = [_value(part) for part in listed[1].split(",")] if listed else _value(text) if text else []
    return found


def _value(text: str) -> Any:
    """A number, a truth as 0 or 1, or a word without its quotes."""
    text = text.strip()
    if text.lower() in ("true", "false"):
        return int(text.lower() == "true")
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text[1:-1] if len(text) > 1 and text[0] == text[-1] and text[0] in "\"'" else text


def _grey(data: bytes, name: str) -> tuple[Array, NDArray[np.bool_]]:
    """The mean of each pixel's colours, 0 to 255, and whether it is transparent: (rows, columns), the lowest first."""
    from PIL import Image

    try:
        with Image.open(BytesIO(data), formats=_FORMATS) as image:
            if max(image.size) > MAX_SIDE:
                found = f"{image.size[0]} x {image.size[1]} pixels"
                raise InvalidValue("", found, f"at most {MAX_SIDE} x {MAX_SIDE}")
            if image.mode not in ("1", "L", "LA", "P", "RGB", "RGBA"):
                raise InvalidValue("", f"{name} with pixels {image.mode!r}", "a picture with 8 bits a colour")
            if image.mode in ("1", "L"):
                grey = np.asarray(image.convert("L"), float)
                clear = np.zeros(grey.shape, bool)
            else:
                colours = np.asarray(image.convert("RGBA"))
                grey, clear = colours[..., :3].mean(axis=-1), colours[..., 3] == 0
    except InvalidValue:
        raise
    except Exception as error:  # damaged pictures raise errors of many types
        reason = str(error).partition(" <")[0]  # without an address in memory
        raise InvalidValue("", name, f"a PGM, PNG or BMP picture that can be read ({reason})") from None
    return grey[::-1], clear[::-1]


def _grid(info: MapInfo, grey: Array, clear: NDArray[np.bool_]) -> OccupancyGrid:
    """The cells of a picture as the modes read it."""
    dark = grey if info.negate else 255.0 - grey
    raw = info.mode == "raw"
    p = (255.0 - dark) / 100.0 if raw else dark / 255.0
    cells = np.full(p.shape, FREE, np.int8)
    cells[p > info.occupied_thresh] = OCCUPIED
    if info.mode == "trinary":
        cells[(p >= info.free_thresh) & (p <= info.occupied_thresh)] = UNKNOWN
    cells[clear | (raw & (p > 1.0))] = UNKNOWN
    return OccupancyGrid(info, cells)


# ------------------------------------------------------------------------------------------- walls


def put_map(document: dict[str, Any], folder: Path | None) -> None:
    """Puts walls in place of the table [map] of a run file, behind those that are there.

    The map's path counts from `folder`, or else from the working folder; without a folder none is allowed. Raises
    InvalidValue, also for a start or a goal of the robot that is not on a free cell.
    """
    if "map" not in document:
        return
    with below("map"):
        given = settled(MapFile, document.pop("map"))
        path = files.found("file", given.file, folder, "nothing")
        try:
            grid = read_map(path)
        except InvalidValue as error:
            inner = InvalidValue(error.key, error.found, error.allowed, nearest=error.nearest)
            raise InvalidValue("file", given.file, f"a map that can be read ({inner})") from None
        walls = map_walls(grid, unknown_blocks=given.unknown == "blocked")
    with below("route"):
        route, minds = document.get("route"), given.unknown == "free"
        factor = route.get("unknown") if isinstance(route, dict) else None
        if isinstance(route, dict) and minds and isinstance(factor, int | float) and factor > 1.0:
            route.setdefault("unseen", unknown_floor(grid))
    others = document.get("walls", [])
    if isinstance(others, list):
        document["walls"] = [*others, *({**wall, "height": given.height} for wall in walls)]
    robot = document.get("robot")
    if isinstance(robot, dict):
        for key in ("start", "goal"):
            _check_free(f"robot.{key}", robot.get(key), grid, given.unknown)
    people = document.get("people")
    for i, person in enumerate(people if isinstance(people, list) else ()):
        if isinstance(person, dict):
            _check_free(f"people.{i}.start", person.get("start"), grid, given.unknown)


def _check_free(key: str, point: Any, grid: OccupancyGrid, unknown: str) -> None:
    """Raises InvalidValue for a point within what the map blocks; what is no point is refused elsewhere."""
    if not (isinstance(point, list) and len(point) > 1 and all(isinstance(v, int | float) for v in point)):
        return
    cell = grid.cell_of((point[0], point[1]))
    if cell == OCCUPIED or (cell == UNKNOWN and unknown == "blocked"):
        where = "unknown or beyond the map" if cell == UNKNOWN else "occupied"
        more = ', or map.unknown = "free"' if cell == UNKNOWN else ""
        raise InvalidValue(key, point, f"a point on a free cell of the map{more}; there it is {where}")


def map_walls(grid: OccupancyGrid, *, unknown_blocks: bool) -> list[dict[str, Any]]:
    """The walls of a map as tables of `walls`, without heights. Raises InvalidValue for more than MAX_WALLS."""
    blocked = (grid.cells == OCCUPIED) | ((grid.cells == UNKNOWN) & unknown_blocks)
    if unknown_blocks:
        blocked = np.pad(blocked, 1, constant_values=True)
    hint = 'unknown = "free" in [map], or ' if unknown_blocks else ""
    return _strips(grid, edge(blocked, unknown_blocks), int(unknown_blocks), "file", hint)


def unknown_floor(grid: OccupancyGrid) -> list[dict[str, Any]]:
    """The unknown cells of a map and a rim of one around it, as tables like those of walls. Raises InvalidValue."""
    return _strips(grid, np.pad(grid.cells == UNKNOWN, 1, constant_values=True), 1, "unknown", "1, or ")


def _strips(grid: OccupancyGrid, cells: NDArray[np.bool_], rim: int, key: str, hint: str) -> list[dict[str, Any]]:
    """Rectangles that cover the cells that are set; they have a `rim` of so many cells around the map's."""
    (x0, y0, yaw), cell = grid.info.origin, grid.info.resolution
    c, s = cos(yaw), sin(yaw)
    walls: list[dict[str, Any]] = []
    for row, column, rows, columns in rectangles(cells):
        if len(walls) == MAX_WALLS:
            allowed = f"a map of at most {MAX_WALLS} rectangles: {hint}a map with larger cells or without specks"
            raise InvalidValue(key, f"{grid.cells.shape[1]} x {grid.cells.shape[0]} cells", allowed)
        u, v = column - rim + 0.5 * columns, row - rim + 0.5 * rows
        du, dv = (0.5 * columns, 0.0) if columns >= rows else (0.0, 0.5 * rows)
        ends = [(cell * (u + e * du), cell * (v + e * dv)) for e in (-1, 1)]
        placed = [[round(x0 + c * x - s * y, _PLACES), round(y0 + s * x + c * y, _PLACES)] for x, y in ends]
        walls.append({"from": placed[0], "to": placed[1], "thickness": round(cell * min(rows, columns), _PLACES)})
    return walls


def edge(blocked: NDArray[np.bool_], beyond: bool) -> NDArray[np.bool_]:
    """The blocked cells with one among their eight neighbours that is not; `beyond` the edge all are or none is."""
    around = np.pad(blocked, 1, constant_values=beyond)
    across = around[:, :-2] & around[:, 1:-1] & around[:, 2:]
    return blocked & ~(across[:-2] & across[1:-1] & across[2:])


def rectangles(cells: NDArray[np.bool_]) -> Iterator[tuple[int, int, int, int]]:
    """Rectangles that cover the cells that are set, each once: row, column, number of rows and of columns.

    Greedy: from each cell in turn, row by row, the larger of the one that grows along its row first and the one that
    grows along its column first.
    """
    left = cells.copy()
    for row, column in np.argwhere(left).tolist():
        if left[row, column]:
            columns, rows = _run(left[row, column:]), _run(left[row:, column])
            lower = _run(np.all(left[row:, column : column + columns], axis=1))
            further = _run(np.all(left[row : row + rows, column:], axis=0))
            size = (lower, columns) if lower * columns >= rows * further else (rows, further)
            left[row : row + size[0], column : column + size[1]] = False
            yield (row, column, *size)


def _run(flags: NDArray[np.bool_]) -> int:
    """How many are set from the first on."""
    return len(flags) if flags.all() else int(flags.argmin())


# ------------------------------------------------------------------------------------------ writing


def map_of(floor_plan: Floor, points: Array, resolution: float, image: str) -> OccupancyGrid:
    """A map of bodies, which also holds `points` (k, 2) [m]. Raises InvalidValue.

    A cell is occupied where a body meets the circle within it; so is the one under the middle of a disc. Cells to which
    nothing leads from the first point are unknown, as to a robot that drew the map from there.
    """
    from scipy.ndimage import label

    rim = ceil(RIM / resolution)
    bounds = floor_plan.bounds or (points.min(axis=0), points.max(axis=0))
    low = np.floor(np.minimum(bounds[0], points.min(axis=0)) / resolution + _ALIGNED) - rim
    high = np.ceil(np.maximum(bounds[1], points.max(axis=0)) / resolution - _ALIGNED) + rim
    columns, rows = (high - low).astype(int).tolist()
    if max(columns, rows) > MAX_SIDE:
        extent = resolution * max(columns, rows)
        allowed = f"at least {extent / MAX_SIDE:.3g} m: the scene is {extent:.3g} m long, and a map {MAX_SIDE} cells"
        raise InvalidValue("resolution", resolution, allowed)
    x, y = (resolution * (low[k] + 0.5 + np.arange(n)) for k, n in enumerate((columns, rows)))
    occupied = floor_plan.clearance(np.stack(np.meshgrid(x, y), axis=-1)) < (0.5 - _ALIGNED) * resolution
    at = np.floor(floor_plan.discs[:, :2] / resolution - low).astype(int)
    occupied[at[:, 1], at[:, 0]] = True
    info = MapInfo(image, resolution, (float(low[0] * resolution), float(low[1] * resolution), 0.0))
    parts, _ = label(~occupied)  # type: ignore[misc]
    column, row = np.floor(points[0] / resolution - low).astype(int)
    if occupied[row, column]:
        raise InvalidValue("resolution", resolution, "smaller cells: that of the robot's start is occupied")
    cells = np.where(np.asarray(parts) == parts[row, column], FREE, UNKNOWN)
    cells[occupied] = OCCUPIED
    return OccupancyGrid(info, cells.astype(np.int8))


RIM = 1.0  # [m] around all: beyond a map a reader may take all for blocked
_ALIGNED = 1e-6  # [cells] by which the sides of a cell and of a body may differ and be the same


def written_map(grid: OccupancyGrid) -> tuple[bytes, bytes]:
    """The YAML file and the picture, a PGM of 8 bits: black is occupied, white free, grey unknown."""
    info, (rows, columns) = grid.info, grid.cells.shape
    origin = ", ".join(map(repr, info.origin))
    lines = [f'image: "{info.image}"', "mode: trinary", f"resolution: {info.resolution!r}", f"origin: [{origin}]"]
    lines += ["negate: 0", "occupied_thresh: 0.65", "free_thresh: 0.196"]
    grey = np.select([grid.cells == OCCUPIED, grid.cells == FREE], [0, 254], 205).astype(np.uint8)
    picture = b"P5\n%d %d\n255\n" % (columns, rows) + np.ascontiguousarray(grey[::-1]).tobytes()
    return "".join(f"{line}\n" for line in lines).encode(), picture
