"""A scene from above as an SVG picture: what stands in it, people and their ways, the robot and its goal."""

from collections.abc import Iterable, Iterator, Sequence
from math import cos, degrees, hypot, sin

from mjnav.scene.bodies import LaneSpec, Pillar, Table, Wall
from mjnav.scene.people import Person
from mjnav.scene.ranges import Point
from mjnav.scene.ways import planned_legs

WIDTH, MAX_HEIGHT = 640, 480  # [pixels]
MARGIN = 0.5  # [m] around all that is shown
GREY, BLUE, ORANGE, GREEN = "#8a8f98", "#2f6fd0", "#d9822b", "#2e9e5b"  # readable on light and on dark pages


def top_view(
    robot: tuple[Sequence[float], float],
    route: Sequence[Point],
    goal_tolerance: float,
    bodies: Sequence[Wall | Table | Pillar],
    lanes: LaneSpec | None,
    people: Sequence[Person],
) -> str:
    """The SVG element. `robot` is its start (x, y, heading) and radius; lanes are drawn across the picture."""
    ways = _ways(people, bodies)
    (x, y, heading), radius = robot
    points = [(x, y), *route, *(p for way in ways for p in way), *_corners(bodies)]
    points += [_foot(side, (x, y)) for side in ((lanes.left, lanes.right) if lanes is not None else ())]
    left, right = min(p[0] for p in points) - MARGIN, max(p[0] for p in points) + MARGIN
    low, high = min(p[1] for p in points) - MARGIN, max(p[1] for p in points) + MARGIN
    width, height = right - left, high - low
    scale = min(WIDTH / width, MAX_HEIGHT / height)
    line = 1.5 / scale
    shapes = [
        *(_lines(lanes, hypot(width, height), line) if lanes is not None else ()),
        *(shape for body in bodies for shape in _body(body)),
        _polyline([(x, y), *route], GREEN, line, dashed=True),
        _circle(route[-1], goal_tolerance, "none", GREEN, line),
        *(_polyline(way, ORANGE, line, dashed=True) for way in ways),
        *(_circle(person.start, person.radius, ORANGE) for person in people),
        _circle((x, y), radius, BLUE),
        _polyline([(x, y), (x + 2 * radius * cos(heading), y + 2 * radius * sin(heading))], BLUE, 2 * line),
    ]
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" role="img" width="{scale * width:.0f}" height="{scale * height:.0f}" '
        f'viewBox="{left:.3f} {-high:.3f} {width:.3f} {height:.3f}" style="max-width:100%">'
        f'<g transform="scale(1,-1)">{"".join(shapes)}</g></svg>'
    )


def _ways(people: Sequence[Person], bodies: Sequence[Wall | Table | Pillar]) -> list[list[Point]]:
    """Each leg to a waypoint as it is planned; of people without waypoints, two seconds of their first velocity."""
    walls = [body for body in bodies if isinstance(body, Wall)]
    tables = [body for body in bodies if isinstance(body, Table)]
    pillars = [body for body in bodies if isinstance(body, Pillar)]
    ways = [[leg.start, *(leg.points or (leg.end,))] for leg in planned_legs(people, walls, tables, pillars)]
    for (x, y), walk in ((person.start, person.behaviour) for person in people):
        vx, vy = getattr(walk, "velocity", (0.0, 0.0))
        ways.append([(x, y), (x + 2.0 * vx, y + 2.0 * vy)])
    return ways


def _corners(bodies: Iterable[Wall | Table | Pillar]) -> Iterator[Point]:
    for body in bodies:
        if isinstance(body, Wall):
            yield from (body.start, body.end)
        elif isinstance(body, Table):
            yield from ((float(px), float(py)) for px, py in body.legs)
        else:
            (px, py), r = body.position, body.radius
            yield from ((px - r, py - r), (px + r, py + r))


def _body(body: Wall | Table | Pillar) -> Iterator[str]:
    if isinstance(body, Wall):
        yield _polyline([body.start, body.end], GREY, body.thickness)
    elif isinstance(body, Pillar):
        yield _circle(body.position, body.radius, GREY)
    else:
        (px, py), (a, b) = body.position, body.size
        yield (
            f'<rect x="{-0.5 * a:.3f}" y="{-0.5 * b:.3f}" width="{a:.3f}" height="{b:.3f}" fill="{GREY}" '
            f'fill-opacity="0.25" transform="translate({px:.3f},{py:.3f}) rotate({degrees(body.yaw):.2f})"/>'
        )
        yield from (_circle((float(lx), float(ly)), body.leg_radius, GREY) for lx, ly in body.legs)


def _lines(lanes: LaneSpec, length: float, line: float) -> Iterator[str]:
    """Both boundaries a x + b y + c = 0, as far as the picture goes."""
    for a, b, c in (lanes.left, lanes.right):
        (px, py), norm = _foot((a, b, c), (0.0, 0.0)), hypot(a, b)
        dx, dy = -b / norm, a / norm
        ends = [(px + s * length * dx, py + s * length * dy) for s in (-2.0, 2.0)]
        yield _polyline(ends, GREY, line)


def _foot(side: tuple[float, float, float], point: Point) -> Point:
    """The point of a line a x + b y + c = 0 that is nearest to another."""
    a, b, c = side
    way = (a * point[0] + b * point[1] + c) / (a * a + b * b)
    return point[0] - way * a, point[1] - way * b


def _circle(centre: Point, radius: float, fill: str, stroke: str = "none", line: float = 0.0) -> str:
    x, y = centre
    edge = f' stroke="{stroke}" stroke-width="{line:.3f}"' if line else ""
    return f'<circle cx="{x:.3f}" cy="{y:.3f}" r="{radius:.3f}" fill="{fill}"{edge}/>'


def _polyline(points: Sequence[Point], colour: str, width: float, *, dashed: bool = False) -> str:
    dash = f' stroke-dasharray="{4 * width:.3f}"' if dashed else ""
    at = " ".join(f"{x:.3f},{y:.3f}" for x, y in points)
    return f'<polyline points="{at}" fill="none" stroke="{colour}" stroke-width="{width:.3f}"{dash}/>'
