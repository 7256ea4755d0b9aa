"""Run files: TOML in, frozen dataclasses out, checked; and the scenes that come with mjnav."""

from mjnav.scenarios.library import data_folder, describe, names
from mjnav.scenarios.load import dumps, load, loads
from mjnav.scenarios.spec import Scenario

__all__ = ["Scenario", "data_folder", "describe", "dumps", "load", "loads", "names"]
