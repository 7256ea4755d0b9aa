"""What the figures of a run need of one belief."""

from dataclasses import dataclass
from math import nan

from mjnav.messages import Array, RobotBelief, Track


@dataclass(frozen=True, slots=True)
class Believed:
    """The belief about the robot, n = 3, or about a person, n = 4."""

    mean: Array  # (n,)
    covariance: Array  # (n, n)
    ess: float  # effective sample size
    particles: float = nan  # how many; NaN where it is not known
    recovered: bool = False  # the filter was spread again
    unseen: float = 0.0  # [s] since the last detection that belongs to it

    @classmethod
    def of(cls, belief: RobotBelief | Track) -> "Believed":
        """That of a belief."""
        unseen = belief.unseen if isinstance(belief, Track) else 0.0
        return cls(belief.mean, belief.covariance, belief.ess, len(belief.weights), belief.recovered, unseen)
