"""Users' own controllers: by module, by file, and as a class or an object."""

import sys

import pytest

from mjnav.control import Decision, Status, make_controller
from mjnav.errors import InputError, InvalidValue

MODULE = """
from dataclasses import dataclass

from mjnav.control import Decision, Status
from mjnav.control.base import GridController
from mjnav.control.parameters import Parameters


@dataclass(frozen=True, slots=True, kw_only=True)
class SlowParameters(Parameters):
    speed: float = 0.1
    extra: list[str] | None = None


class Slow:
    parameters_type = SlowParameters

    def __init__(self, robot_limits, period, parameters):
        self.parameters = parameters

    def decide(self, observation):
        return Decision(self.parameters.speed, 0.0, Status.OK)

    def closest_cone(self, observation, decision):
        return None


class Bare:
    def __init__(self, robot_limits, period, parameters):
        self.speed = parameters.preferred_speed

    def decide(self, observation):
        return Decision(self.speed, 0.0, Status.OK)


class Lone(Slow):
    def __init__(self): ...


class Untyped(Slow):
    parameters_type = dict


class Unfinished(GridController): ...


def function(): ...
"""


@pytest.fixture
def own(tmp_path, monkeypatch):
    (tmp_path / "own_package").mkdir()
    (tmp_path / "own_package" / "__init__.py").write_text("")
    (tmp_path / "own_package" / "own.py").write_text(MODULE)
    (tmp_path / "own_broken.py").write_text("1 / 0")
    monkeypatch.syspath_prepend(tmp_path)


@pytest.mark.usefixtures("own")
def test_a_class_below_the_protocol_alone_works_with_its_parameters(limits, observe):
    controller = make_controller("own_package.own:Slow", limits, 0.1, speed=0.25, samples=7, extra=["a"])
    assert controller.decide(observe(0)) == Decision(0.25, 0.0, Status.OK)
    assert (controller.parameters.samples, controller.parameters.extra) == (7, ["a"])
    assert controller.parameters.turn_change_weight == pytest.approx(0.01)


@pytest.mark.usefixtures("own")
@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("own_pakage:Slow", "found 'own_pakage:Slow'; allowed: a module that can be imported (ModuleNotFoundError"),
        ("own_broken:Slow", "allowed: a module that can be imported (ZeroDivisionError: division by zero)"),
        ("own_package.own:Slaw", "did you mean 'own_package.own:Slow'?"),
        ("own_package.own:function", "file.py:Class, a controller, which has decide"),
        ("own_package.own:Unfinished", "a controller, which has evaluate"),
        ("own_package.own:Untyped", "whose parameters_type is a dataclass below LoopParameters"),
        ("own_package.own:Lone", "made as Class(robot_limits, period, parameters) (TypeError: "),
        ("__main__:Slow", "the controller itself, handed over in Python"),
        ("own_nowhere.py:Slow", "found 'own_nowhere.py:Slow'; allowed: a Python file that exists"),
    ],
)
def test_what_is_no_controller_is_refused_with_what_it_lacks(limits, name, message):
    with pytest.raises(InvalidValue) as raised:
        make_controller(name, limits, 0.1)
    assert raised.value.key == "method"
    assert message in str(raised.value)


@pytest.mark.usefixtures("own")
def test_a_class_that_decides_and_nothing_else_is_a_controller(limits, observe):
    controller = make_controller("own_package.own:Bare", limits, 0.1, preferred_speed=0.3, samples=9)
    decision = controller.decide(observe(1))
    assert (decision.v, controller.parameters.samples) == (0.3, 9)
    assert controller.closest_cone(observe(1), decision) is None
    with pytest.raises(InvalidValue, match=r"parameters of own_package\.own:Bare: preferred_speed, samples"):
        make_controller("own_package.own:Bare", limits, 0.1, sample=9)


OPENS = """
from mjnav.control.policy import PolicyController


class Policy(PolicyController):
    def __init__(self, *arguments):
        super().__init__(*arguments)
        self.weights = open("weights.txt").read()

    def act(self, blocks): ...
"""


def test_a_policy_that_cannot_open_its_file_is_refused_with_the_file_and_the_reason(limits, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "policy.py").write_text(OPENS)
    for reason in ("No such file or directory", "Is a directory"):
        with pytest.raises(InputError) as raised:
            make_controller("policy.py:Policy", limits, 0.1)
        assert str(raised.value) == f"the controller policy.py:Policy cannot open 'weights.txt': {reason}"
        (tmp_path / "weights.txt").mkdir(exist_ok=True)


class Still:
    """Stands, and counts how often it was asked."""

    asked = 0

    def __init__(self, *arguments):
        self.arguments = arguments

    def decide(self, observation):
        self.asked += 1
        return Decision(0.0, 0.0, Status.STOPPED)


def test_a_class_is_made_and_an_object_is_used_as_it_is(limits, observe):
    make_controller(Still, limits, 0.1).decide(observe(0))
    assert Still.asked == 0
    mine = Still()
    make_controller(mine, limits, 0.1, preferred_speed=0.5).decide(observe(0))
    assert (mine.asked, mine.arguments) == (1, ())
    with pytest.raises(InvalidValue, match=r"degree: found 3; allowed: no parameters beside .*:Still\(\), an object"):
        make_controller(mine, limits, 0.1, degree=3)
    with pytest.raises(InvalidValue, match="a controller, which has decide"):
        make_controller(3, limits, 0.1)


@pytest.fixture
def working_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [folder for folder in sys.path if folder])
    return tmp_path


LAZY = """
    def __init__(self, robot_limits, period, parameters):
        import own_beside_later
"""


def test_the_working_folder_is_searched_during_that_import_alone(limits, working_folder):
    package = working_folder / "own_here"
    package.mkdir()
    (package / "__init__.py").write_text("import sys\nPATH = list(sys.path)\nimport own_beside\n")
    (package / "own.py").write_text(f"{MODULE}\n\nclass Lazy(Slow):{LAZY}")
    for name in ("own_beside", "own_beside_later"):
        (working_folder / f"{name}.py").write_text("")
    before = list(sys.path)
    make_controller("own_here.own:Slow", limits, 0.1)
    assert [*before, ""] == sys.modules["own_here"].PATH  # last: it shadows nothing
    assert sys.path == before
    with pytest.raises(InvalidValue, match="No module named 'own_beside_later'"):
        make_controller("own_here.own:Lazy", limits, 0.1)


FILE = """
from dataclasses import dataclass
from beside_it import SPEED
from mjnav.control import Decision, Status
from mjnav.control.parameters import LoopParameters


@dataclass(frozen=True, slots=True, kw_only=True)
class PolicyParameters(LoopParameters):
    speed: float = SPEED


class Policy:
    parameters_type = PolicyParameters

    def __init__(self, robot_limits, period, parameters):
        self.parameters = parameters

    def decide(self, observation):
        return Decision(self.parameters.speed, 0.0, Status.OK)
"""


def test_a_class_of_a_file_finds_its_neighbours_wherever_it_lies(limits, working_folder, monkeypatch):
    for folder, speed in (("one", 0.1), ("two.two", 0.2)):
        (working_folder / folder).mkdir()
        (working_folder / folder / "policy.py").write_text(f"from __future__ import annotations\n{FILE}")
        (working_folder / folder / "beside_it.py").write_text(f"SPEED = {speed}")
    before = list(sys.path)
    first = make_controller("one/policy.py:Policy", limits, 0.1)
    monkeypatch.delitem(sys.modules, "beside_it")
    second = make_controller(f"{working_folder}/two.two/policy.py:Policy", limits, 0.1)
    monkeypatch.delitem(sys.modules, "beside_it")
    assert (first.decide(None).v, second.decide(None).v) == (0.1, 0.2)  # two files of one name are two modules
    assert sys.path == before
    monkeypatch.chdir(working_folder / "one")
    assert type(make_controller("policy.py:Policy", limits, 0.1)._controller) is type(first._controller)
    with pytest.raises(InvalidValue, match="speed: found 'fast'; allowed: a number"):
        make_controller("policy.py:Policy", limits, 0.1, speed="fast")
    with pytest.raises(InvalidValue, match=r"did you mean 'policy.py:Policy'\?"):
        make_controller("policy.py:Polcy", limits, 0.1)
