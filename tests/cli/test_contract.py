"""What every command keeps to: help, one line for every mistake, exit codes, one JSON object, and quiet."""

import json
import shlex
import shutil
import sys

import pytest
from mcap.writer import Writer

from mjnav.cli.main import COMMANDS, main
from mjnav.errors import missing_extra
from tests.cli.test_compare_command import STUDY, fill
from tests.scene.conftest import made_up

pytestmark = pytest.mark.xdist_group("real time")

QUICK = "--set physics.engine=kinematic --set time_limit=0.4"
# Words with which each command works, in a folder with the files below; those with --json first.
WORKING = {
    "run": f"crossing1 --no-log {QUICK}",
    "list": "engines",
    "keys": "robot.radius",
    "inspect": "a.mcap",
    "replay": "a.mcap",
    "export": "a.mcap out --format csv",
    "recover": "a.mcap b.mcap",
    "surface": f"crossing1 --at 0.2 --grid 5 -o a.png {QUICK}",
    "sweep": "two.toml --dry-run -o rows",
    "compare": "two.toml",
    "bench": "--suite dsrnn",
    "avoidable": "a.mcap",
    "predict": f"crossing1 --model constant_velocity {QUICK}",
    "rate-test": f"crossing1 --controller mean --duration 0.1 {QUICK}",
    "import": "crowd walkers.txt --frame-rate 25",
    "noise": "fit errors.csv",
    "robot": "check burger",
    "map": "save hall -o hall.yaml",
    "show": "hall",
    "report": "a.mcap",
    "render": "a.mcap -o a.png",
    "paper": "--only table --draw",
    "schema": "run",
    "completion": "bash",
}
WITH_JSON = [*WORKING][: [*WORKING].index("show")]
SILENT = ("list", "keys", "show", "schema", "completion")  # they only print, and have no -q
OF_LOGS = ("inspect", "report", "render", "replay", "export", "recover")


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A log, whole and damaged, files that are none, a recording, a study and its results."""
    folder = tmp_path_factory.mktemp("files")
    log = folder / "a.mcap"
    assert main(["run", "crossing1", "--controller", "mean", "--log", str(log), *QUICK.split()]) == 0
    content = bytearray(log.read_bytes())
    (folder / "cut.mcap").write_bytes(content[: len(content) // 2])
    content[content.index(b"lz4") + 200] ^= 0xFF
    (folder / "damaged.mcap").write_bytes(content)
    (folder / "garbage.mcap").write_bytes(b"garbage, and more than eight bytes of it")
    (folder / "empty.mcap").touch()
    (folder / "magic.mcap").write_bytes(b"\x89MCAP0\r\n")
    (folder / "folder.mcap").mkdir()
    with open(folder / "foreign.mcap", "wb") as file:
        writer = Writer(file)
        writer.start()
        writer.finish()
    (folder / "walkers.txt").write_text(made_up())
    (folder / "errors.csv").write_text("\n".join(["x", *map(str, range(30))]))
    (folder / "two.toml").write_text(STUDY)
    fill(folder / "runs/out/two methods")
    return folder


@pytest.fixture
def call(mjnav, files, tmp_path):
    """Calls a command line in a folder with all files."""
    shutil.copytree(files, tmp_path, dirs_exist_ok=True)
    return lambda words: mjnav(*shlex.split(words))


def names(folder) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*")}


def test_the_table_has_every_command():
    assert set(WORKING) == set(COMMANDS)


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help_and_answers_an_unknown_option_with_the_nearest(call, capsys, command):
    shown = []
    for words in ([command, "--help"], ["help", command]):
        with pytest.raises(SystemExit) as ended:
            main(words)
        assert ended.value.code == 0
        shown.append(capsys.readouterr().out)
    assert shown[0] == shown[1]
    assert shown[0].startswith(f"usage: mjnav {command} ")
    answers = {"-x": f"`mjnav {command} --help` shows what it takes"}
    for wrong, answer in (answers | {"--jsno": "did you mean --json?"} if command in WITH_JSON else answers).items():
        said = call(f"{command} {WORKING[command]} {wrong}")
        assert (said.code, said.out) == (2, "")
        assert said.err == f"mjnav: mjnav {command} has no option {wrong}; {answer}\n"


@pytest.mark.parametrize("command", WITH_JSON)
def test_json_is_one_object_with_a_schema_and_quiet_prints_nothing(call, command):
    words = f"{command} {WORKING[command]}"
    said = call(f"{words} --json")
    assert said.code == 0
    assert said.out.count("\n") == 1
    assert json.loads(said.out, parse_constant=pytest.fail)["schema"] == 1  # NaN and infinity are no JSON
    if command not in (*SILENT, "export", "recover", "map"):  # which write a file that must not be there
        assert call(f"{words} -q").out == ""


# What is refused with exit code 2, and a part of the line that says so.
REFUSED = """
rum hall -> command: found 'rum'; allowed:
RUN hall -> did you mean 'run'?
--jsn -> mjnav has no option --jsn; `mjnav --help` shows
run -> the following arguments are required: SCENE
run hall table -> mjnav run does not take 'table'; `mjnav run --help` shows
run --set seed 3 hall -> argument --set: found 'seed'; allowed: KEY=VALUE in one word
run hall --log a --no-log -> argument --no-log: not allowed with argument --log
run hal -> scene: found 'hal'
run ./hall.toml -> ./hall.toml: found nothing; allowed: a run file that can be read (No such file
run hall --controller RKH -> --controller: control.method: found 'RKH'
run hall --set control.degre=3 -> did you mean 'degree'?
run hall --set control.rate=30 -> control.rate: found 30
run hall --overruns abort -> --overruns needs --real-time, --live or --view
run hall --real-time --overruns abrot -> did you mean 'abort'?
run hall --log /dev/null -> /dev/null: exists already
run hall --log new/a.mcap -> new/a.mcap: there is no folder /
run hall --port 8765 -> --port needs --live
run crossing1 --view -> no display: use `mjnav run --live`
run hall --live --port 70000 -> --port: found 70000; allowed: a whole number from 0 to 65535
run hall --require time>=5 -> did you mean 'time_s'?
run hall --max-seconds 0 -> --max-seconds: found 0.0; allowed: a number > 0 and
rate-test hal -> did you mean 'hall'?
rate-test hall --rate 0 -> rate: found 0.0; allowed: a number from 0.1 to 1000 Hz
rate-test hall --rate 33.3333 -> a rate with a time step in common with sensors.rate (10 Hz)
rate-test hall --set control.rate=33.3333 -> a rate with a time step in common with sensors.rate (10 Hz)
rate-test hall --duration 0 -> duration: found 0.0; allowed: a number > 0
rate-test hall --set robot.goal_tolerance=9.0 -> robot.goal: found
surface crossing1 --at 1 --grid 1 -> --grid: found 1; allowed: a whole number from 2
surface crossing1 --at 1 -o a.jpg -> --output: found 'a.jpg'; allowed: a file name that ends in .png
show HALL -> did you mean 'hall'?
show rooms --set layuot.seed=7 -> did you mean 'layout'?
show hall -o two.toml -> two.toml: exists already; choose another name
list chanels -> kind: found 'chanels'
keys robot.raduis -> did you mean 'robot.radius'?
keys --controller rkhz -> did you mean 'rkhs'?
keys --study --controller rkhs -> --controller needs run files: leave out --study
completion tcsh -> 'tcsh'
sweep crosings -> did you mean 'crossings'?
sweep two.toml --workers 0 -> --workers: found 0; allowed: a whole number from 1 to 10000
sweep two.toml --scene hal -> --scene: scene: found 'hal'
sweep two.toml --set time_limt=3 -> --set: time_limt: found 'time_limt'
compare crossings -> runs/out/crossings: no results of a sweep; mjnav sweep crossings makes them
compare two.toml --reference men -> --reference: found 'men'; allowed: mean, rkhs; did you mean 'mean'?
compare two.toml --figure time -> did you mean 'time_s'?
compare two.toml -o t.xls -> --output: found 't.xls'
avoidable gone.mcap -> gone.mcap: cannot be read: No such file or directory
avoidable method -> LOG: found 'method'; allowed: a log, a folder of logs, or
paper --only lanes -> did you mean 'lane'
paper --seeds 0 -> --seeds: found 0
import crowd walkers.txt --frame-rate 25 --set physics.enginx=kinematic -> --set needs -o FILE.toml
import crowd gone.txt --frame-rate 25 -> gone.txt: found nothing; allowed: a recording that can be read (No such file
import crowd walkers.txt -> --frame-rate: found nothing; allowed: what the column of frames counts a second: 25
predict walkers.txt -> --frame-rate: found nothing; allowed: what the recording's column of frames counts a second
predict crossing1 --frame-rate 25 -> --frame-rate: found 25.0; allowed: none but of a recording
predict gone.txt --frame-rate 25 -> scene: found 'gone.txt'
predict crossing1 --model constant_velocity constant_velocty -> did you mean 'constant_velocity'?
import crowd walkers.txt --people 3 -> --people needs -o FILE.toml
import crowd walkers.txt --duration 0 -> --duration: found 0.0; allowed: a number from 1 to 1000000 s
import crowd walkers.txt --frame-rate 25 --set crowd.scal=2 -> --set: crowd.scal: found 'scal'; allowed: crop,
import crowd walkers.txt --frame-rate 25 -o c.toml --set crowd.window=[90.0,99.0] -> --set: crowd.window: found (90.0
import crowd walkers.txt --frame-rate 25 -o c.toml --set robot.radus=1 -> c.toml: robot.radus: found 'radus'; allowed
render a.mcap -o a.avi -> --output: found 'a.avi'; allowed: a file name that ends in .png or .mp4 or .gif
render a.mcap -o no/a.mp4 -> there is no folder
render a.mcap -o a.png --size big -> --size: found 'big'
render a.mcap -o a.png --size 100000x100000 -> --size: found (100000, 100000); allowed: (width, height), numbers from
render a.mcap -o a.gif --fps 60 -> --fps: found 60; allowed: at most 50 for a GIF
replay a.mcap --controller rkhz -> --controller: control.method: found 'rkhz'
show two.toml -> two.toml: a run file is shown with --seed or --set
sweep two.toml --scheduler foo -> --scheduler: found 'foo'; allowed: the address of a Dask scheduler
bench rkhs --set method=dwa -> --set: found 'method'; allowed: a parameter of the method
bench mean --quick --share 0.5 -> argument --share: not allowed with argument --quick
render a.mcap -o a.png --at 2 -> --at: found 2.0; allowed: a time from 0 to 0.4 s
export gone.mcap out --format rosbag -> did you mean 'rosbag2'?
export a.mcap out --format csv --topic /scann -> did you mean '/scan'?
export a.mcap two.toml --format csv -> two.toml: exists already
recover a.mcap two.toml -> two.toml: exists already
"""


@pytest.mark.parametrize("row", REFUSED.strip().splitlines())
def test_a_mistake_is_one_line_and_exit_code_2_and_starts_and_leaves_nothing(call, tmp_path, monkeypatch, row):
    words, line = row.split(" -> ")
    monkeypatch.setattr("mjnav.loop.episode.Episode.run", pytest.fail)
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    before = names(tmp_path)
    said = call(words)
    assert (said.code, said.out) == (2, "")
    assert said.err.startswith("mjnav: ")
    assert line in said.err
    assert said.err.count("\n") == 1
    assert names(tmp_path) == before


NO_LOGS = {
    "gone.mcap": (2, "cannot be read: No such file"),
    "folder.mcap": (2, ""),
    "empty.mcap": (2, "not an MCAP file"),
    "garbage.mcap": (2, "not an MCAP file"),
    "magic.mcap": (3, ""),  # nothing in it can be read
}


@pytest.mark.parametrize("file", NO_LOGS)
@pytest.mark.parametrize("command", OF_LOGS)
def test_what_is_no_log_is_told_in_one_line_and_leaves_nothing(call, tmp_path, command, file):
    code, line = NO_LOGS[file]
    before = names(tmp_path)
    said = call(f"{command} {WORKING[command].replace('a.mcap', file)}")
    assert (said.code, said.out) == (code, "")
    assert said.err.startswith(f"mjnav: {file}: ")
    assert line in said.err
    assert said.err.count("\n") <= (1 if code == 2 else 2)  # what `recover` may save is told, too
    assert names(tmp_path) == before


@pytest.mark.parametrize(
    ("file", "codes"),
    [
        ("foreign.mcap", {"inspect": 0, "report": 2, "render": 2, "replay": 2, "export": 2, "recover": 0}),
        ("cut.mcap", dict.fromkeys(OF_LOGS, 0)),
        ("damaged.mcap", {"inspect": 3, "report": 3, "render": 3, "replay": 3, "export": 3, "recover": 0}),
    ],
)
def test_what_is_left_of_a_log_is_used_and_damage_is_exit_code_3(call, file, codes):
    for command, code in codes.items():
        said = call(f"{command} {WORKING[command].replace('a.mcap', file)}")
        assert said.code == code, (command, said)
        assert (said.err == "") == (code == 0)
        assert "damaged" in said.err or code != 3


@pytest.mark.parametrize(
    ("words", "module", "package", "extra"),
    [
        ("sweep two.toml -o rows", "pyarrow.parquet", "pyarrow", "sweep"),
        ("compare two.toml", "pyarrow.parquet", "pyarrow", "sweep"),
        ("render a.mcap -o a.mp4", "av", "av", "video"),
        ("export a.mcap out --format rosbag2", "rosbags", "rosbags", "ros2"),
        ("run crossing1 --live", "foxglove", "foxglove-sdk", "live"),
    ],
)
def test_a_package_that_is_missing_is_named_with_the_command_that_installs_it(
    call, monkeypatch, words, module, package, extra
):
    monkeypatch.setitem(sys.modules, module, None)
    said = call(words)
    assert (said.code, said.out, said.err) == (2, "", f"mjnav: {missing_extra(package, extra)}\n")


def test_an_interrupt_is_one_line_and_exit_code_130(call, monkeypatch):
    def interrupt(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("mjnav.cli.run.load_scenario", interrupt)
    said = call("run hall")
    assert (said.code, said.out, said.err) == (130, "", "mjnav: interrupted\n")


def test_quiet_leaves_errors_and_a_traceback_comes_on_request_alone(call):
    assert call(f"run crossing1 -q --no-log {QUICK}").code == 0
    wrong = "run crossing1 --set robot.radius=9"
    line = "mjnav: --set: robot.radius: found 9.0; allowed: a number from 0.1 to 0.5 m\n"
    assert call(f"{wrong} -q").err == call(wrong).err == line
    said = call(f"{wrong} --traceback")
    assert (said.code, said.err.splitlines()[0], said.err.endswith(line)) == (
        2,
        "Traceback (most recent call last):",
        True,
    )
