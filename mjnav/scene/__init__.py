"""Run files: TOML in, frozen dataclasses out, checked; and the scenes that come with mjnav."""

from mjnav.scene.library import data_folder, describe, names
from mjnav.scene.load import dumps, load, loads
from mjnav.scene.spec import Scenario

__all__ = ["Scenario", "data_folder", "describe", "dumps", "load", "loads", "names"]
