"""The people of a scene and how they walk: one file for each family of behaviours."""

from mjnav.scenarios.people.avoiding import Orca as Orca
from mjnav.scenarios.people.avoiding import SocialForce as SocialForce
from mjnav.scenarios.people.person import BEHAVIOURS as BEHAVIOURS
from mjnav.scenarios.people.person import Behaviour as Behaviour
from mjnav.scenarios.people.person import Person as Person
from mjnav.scenarios.people.replay import Replay as Replay
from mjnav.scenarios.people.straight import MAX_WALKING_SPEED as MAX_WALKING_SPEED
from mjnav.scenarios.people.straight import PERIOD as PERIOD
from mjnav.scenarios.people.straight import ConstantVelocity as ConstantVelocity
from mjnav.scenarios.people.straight import StopAndGo as StopAndGo
from mjnav.scenarios.people.temperament import TEMPERAMENTS as TEMPERAMENTS
from mjnav.scenarios.people.trips import Trip as Trip
from mjnav.scenarios.people.walkers import REACHED as REACHED
from mjnav.scenarios.people.walkers import Walker as Walker
from mjnav.scenarios.people.walkers import Waypoints as Waypoints
