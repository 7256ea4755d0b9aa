"""How people take a robot that they see."""

from collections.abc import Mapping
from types import MappingProxyType

REGULAR, YIELDS, IMPASSIVE = "regular", "yields", "impassive"
CURIOUS, SCARED, THREATENING = "curious", "scared", "threatening"

# After the six of HuNavSim (Perez-Higueras et al. 2023), where `yields` is called surprised.
TEMPERAMENTS: Mapping[str, str] = MappingProxyType(
    {
        REGULAR: "takes the robot as the behaviour does: as anybody, or not at all",
        YIELDS: "stands while the robot is near",
        IMPASSIVE: "ignores the robot",
        CURIOUS: "walks up to the robot",
        SCARED: "walks slowly, and away from the robot",
        THREATENING: "steps in front of the robot",
    }
)
