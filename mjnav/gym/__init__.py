"""Gymnasium environments: `mjnav/Hall-v0`, and `mjnav/Scene-v0` for any run file.

    import gymnasium
    import mjnav.gym  # registers them

    env = gymnasium.make("mjnav/Hall-v0", features=("robot", "people"))

Gymnasium 1.0 stopped reading the entry points of installed packages, so this module is imported, or named in the id:
`gymnasium.make("mjnav.gym:mjnav/Hall-v0")`.
"""

from mjnav.errors import missing_extra

try:
    import gymnasium
except ModuleNotFoundError as error:
    if error.name != "gymnasium":
        raise
    raise missing_extra("gymnasium", "gym") from None

from mjnav.gym.env import SceneEnv, VectorSceneEnv
from mjnav.gym.reward import PUBLISHED, TERMS

__all__ = ["PUBLISHED", "TERMS", "SceneEnv", "VectorSceneEnv", "register"]


def register() -> None:
    """Registers the environments; once more changes nothing."""
    for name, scene in (("Hall", {"scene": "hall"}), ("Scene", {})):
        if (name := f"mjnav/{name}-v0") not in gymnasium.registry:
            single, vector = "mjnav.gym.env:SceneEnv", "mjnav.gym.env:VectorSceneEnv"
            gymnasium.register(name, entry_point=single, vector_entry_point=vector, kwargs=scene)


register()
