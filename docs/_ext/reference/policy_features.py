"""What a learned policy sees, with the bounds of a robot with the default limits."""

from mjnav.control.policy import BLOCKS, PERSON, ROBOT, Encoder, Features
from mjnav.messages import RobotLimits
from mjnav.settings import keys

from .markdown import escape

UNITS = {"distance": "m", "v": "m/s", "omega": "rad/s", "std_along": "m", "std_across": "m", "std_heading": "rad",
         "x": "m", "y": "m", "vx": "m/s", "vy": "m/s", "radius": "m", "clearance": "m", "std_x": "m", "std_y": "m",
         "std_vx": "m/s", "std_vy": "m/s"}  # fmt: skip


def markdown() -> str:
    """The options of `Features`, and the columns of the blocks that have names."""
    features = Features(blocks=BLOCKS)
    bounds = Encoder(features, RobotLimits()).bounds
    options = [
        f"| `{key}` | {escape(str(found.default))} | {escape(found.description)} |"
        for key, found in keys(Features).items()
    ]
    text = ["| option of `Features` | default | |", "|---|---|---|", *options, ""]
    for block, columns in (("robot", ROBOT), ("people", PERSON)):
        low, high = (end.reshape(-1, len(columns))[0] for end in bounds[block])
        text += [f"Columns of `{block}`:", "", "| index | name | unit | from | to |", "|---|---|---|---|---|"]
        text += [
            f"| {i} | `{name}` | {UNITS.get(name, '')} | {low[i]:g} | {high[i]:g} |" for i, name in enumerate(columns)
        ]
        text.append("")
    return "\n".join(text)
