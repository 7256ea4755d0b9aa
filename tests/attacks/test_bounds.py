"""What a run file may ask for ends where a machine does: refused with the key, what came and what is allowed."""

import pytest

from mjnav import scene
from mjnav.cli.main import main
from mjnav.errors import InvalidValue
from mjnav.loop.episode import Episode
from mjnav.loop.supervision import RunFault
from mjnav.noise import CHANNELS
from mjnav.settings.marks import Range, mark
from mjnav.world.engine import DivergedError
from tests.attacks.run_files import LEAVES, is_number

NUMBERS = [leaf for leaf in LEAVES if is_number(leaf) and leaf.path[-1] != "seed"]


def test_every_number_of_a_run_file_has_an_upper_bound():
    """Of every table, method, behaviour and distribution, so of a key that is added later, too."""
    assert len(NUMBERS) > 200
    for leaf in NUMBERS:
        limits = mark(leaf.hint, Range)
        assert limits is not None, leaf.path
        assert limits.high <= 1e9, leaf.path


# --set on crossing1 -> what the one line on standard error holds
TOO_MUCH = {
    "noise.pose.x={distribution='gaussian', std=1e8}": "noise.pose.x.std: found 100000000.0; allowed: ",
    "control.latency={trace=[0.01], planned=500.0}": "control.latency.planned: found '500 s at a period of 0.1 s'; ",
    "control.num_v=1000000000000": "control.num_v: found 1000000000000; allowed: a whole number from 1 to 1000000",
    "control={method='rkhs', num_v=1000, num_omega=1000}": "this takes 10 GB",
    "control={method='mppi', rollouts=1000000, steps=1000}": "'1000000 rollouts of 1000 steps, 25 samples",
    "walls=[{from=[0, 1e300], to=[1, 1e300]}]": "walls.0.from.1: found 1e+300; allowed: ",
}


@pytest.mark.parametrize("override", TOO_MUCH)
def test_a_value_too_large_for_any_machine_is_refused_before_the_run(override, capsys):
    assert main(["run", "crossing1", "--no-log", "--set", override]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert len(said.err.splitlines()) == 1
    assert TOO_MUCH[override] in said.err


HEAD = 'schema = 1\nname = "many"\n[robot]\nstart = [0, 0, 0]\n'
PERSON = '[[people]]\nstart = [{}, 4]\nbehaviour = "constant_velocity"\nvelocity = [0, 0]\n'
TOO_MANY = {
    "people": (HEAD + "goal = [9, 0]\n" + "".join(PERSON.format(2 + 2 * i) for i in range(501)), "found '501 of them'"),
    "time_limit": (
        f"time_limit = 1e6\n{HEAD}goal = [9, 0]\n[control]\nrate = 100\n",
        "found '1e+06 s: 1e+08 ticks, 0 people'; allowed: what takes at most 8 GB of memory in all; this takes 25.6 GB",
    ),
    "estimation.obstacles.particles": (
        HEAD + "goal = [9, 0]\n" + "".join(PERSON.format(2 + 2 * i) for i in range(100))
        + "[estimation]\nobstacles = { particles = 1000000 }",
        "found '1000000 for each of 100 people'; allowed: what takes at most 8 GB",
    ),
}  # fmt: skip


@pytest.mark.parametrize("key", TOO_MANY)
def test_numbers_too_large_together_are_refused_with_the_memory_they_take(key):
    text, message = TOO_MANY[key]
    with pytest.raises(InvalidValue) as raised:
        scene.loads(text)
    assert raised.value.key == key
    assert message in str(raised.value)


@pytest.mark.parametrize("engine", ["kinematic", "mujoco"])
@pytest.mark.parametrize("robot", ["particle", "ekf"])
def test_a_run_with_the_widest_noise_allowed_ends(engine, robot):
    """The robot may be thrown out of the room, and the physics lost; nothing of mjnav's own breaks."""
    scenario = scene.load("hall", [
        f"physics.engine={engine}", f"estimation.robot.filter={robot}", "time_limit=2", "stop_on_collision=false",
        *(f"noise.{channel}={{distribution='gaussian', std=1e4}}" for channel in CHANNELS),
    ])  # fmt: skip
    try:
        assert Episode(scenario).run().summary["outcome"] == "timeout"
    except RunFault as fault:
        if not isinstance(fault.__cause__, DivergedError):
            raise
