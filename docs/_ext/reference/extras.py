"""The extras of the package, from pyproject.toml, each with what it brings and what it is for."""

import tomllib
from pathlib import Path

PURPOSE = {
    "gym": "the Gymnasium environments",
    "live": "`mjnav run --live`: a run in Foxglove or Lichtblick while it goes",
    "pandas": "tables of a log as DataFrames, and Parquet files",
    "ros2": "`mjnav export --format rosbag2`",
    "sweep": "`mjnav sweep`, `mjnav compare`, `mjnav paper`",
    "video": "`mjnav render -o FILE.mp4`",
}


def markdown() -> str:
    """A table of the extras. Raises KeyError for one without a purpose."""
    project = tomllib.loads((Path(__file__).parents[3] / "pyproject.toml").read_text())["project"]
    rows = [
        f"| `{name}` | {PURPOSE[name]} | {', '.join(f'`{package}`' for package in packages)} |"
        for name, packages in sorted(project["optional-dependencies"].items())
    ]
    return "\n".join(["| extra | for | packages |", "|---|---|---|", *rows])
