"""Laws fitted to errors that are known, files of errors in run files, and what is said of files that are none."""

import json

import numpy as np
import pytest

import mjnav
from mjnav.cli.main import main
from mjnav.errors import InvalidValue
from mjnav.noise import Mixture, Pearson
from mjnav.noise.distributions import MAX_SAMPLES
from mjnav.noise.fit import FEWEST, fits, mixture_fit, pearson_fit
from mjnav.scene import dumps, loads

SKEWED = Pearson(mean=0.02, std=0.08, skew=1.2, kurtosis=5.2)
TWO = Mixture(weights=(0.3, 0.7), means=(-0.4, 0.2), stds=(0.05, 0.1))
RUN = """
schema = 1
name = "measured"
time_limit = 2.0
[robot]
start = [0.0, 0.0, 0.0]
goal = [3.0, 0.0]
[physics]
engine = "kinematic"
[noise.pose.x]
distribution = "empirical"
"""


def drawn(law, num=4000):
    return law.sample(np.random.default_rng(7), num)


def write(path, rows, head="time,x"):
    path.write_text("\n".join([head, *rows]) + "\n")
    return path


def test_a_pearson_law_is_found_again():
    found = pearson_fit(drawn(SKEWED, 40_000))
    assert (found.mean, found.std) == pytest.approx((0.02, 0.08), abs=0.002)
    assert (found.skew, found.kurtosis) == pytest.approx((1.2, 5.2), rel=0.15)
    best = fits(drawn(SKEWED))[0]
    assert best.name in ("pearson", "mixture")
    assert best.distance < 0.02


def test_a_mixture_is_found_again_with_its_number_of_components():
    found = mixture_fit(drawn(TWO))
    order = np.argsort(found.means)
    assert np.array(found.weights)[order] == pytest.approx([0.3, 0.7], abs=0.03)
    assert np.array(found.means)[order] == pytest.approx([-0.4, 0.2], abs=0.02)
    assert np.array(found.stds)[order] == pytest.approx([0.05, 0.1], abs=0.01)
    assert fits(drawn(TWO))[0].name == "mixture"
    assert {fit.name: fit.distance for fit in fits(drawn(TWO))}["pearson"] > 0.03  # two hills are no Pearson law


@pytest.mark.parametrize(
    "errors",
    [
        np.ones(100),
        np.zeros(100),
        np.r_[1.0, np.zeros(19)],
        np.linspace(0.0, 1.0, FEWEST - 1),
        np.linspace(1e6, 1e6 + 1.0, 50),
    ],
)
def test_too_few_errors_equal_ones_and_those_of_another_unit_are_refused(errors):
    with pytest.raises(InvalidValue):
        fits(errors)


def test_a_law_with_two_values_has_a_pearson_law_near_it():
    assert pearson_fit(np.repeat([-1.0, 1.0], 50)).std == pytest.approx(1.0)


def test_a_column_of_a_file_is_as_good_as_its_numbers(tmp_path):
    errors = drawn(SKEWED, 50).round(6).tolist()
    write(tmp_path / "pose.csv", [f"{k},{x}" for k, x in enumerate(errors)])
    from_file = loads(RUN + 'samples = { file = "pose.csv", column = "x" }', folder=tmp_path)
    inline = loads(RUN + f"samples = {errors}")
    assert dumps(from_file) == dumps(inline)
    log = tmp_path / "run.mcap"
    ran = mjnav.run(from_file, log=log)
    assert ran.summary["state_hash"] == mjnav.run(inline, log=False).summary["state_hash"]
    (tmp_path / "pose.csv").unlink()
    assert mjnav.replay(log).identical


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ('{ file = "none.csv", column = "x" }', "found 'none.csv'; allowed: a column of errors that can be read"),
        ('{ file = "pose.csv", column = "y" }', "column: found 'y'; allowed: time, x"),
        ('{ file = "pose.csv" }', "one of time, x"),
        ('{ file = "bad.csv", column = "x" }', "line 3: found 'much'; allowed: a finite number in column x"),
        ('{ file = "nan.csv", column = "x" }', "line 2: found 'nan'; allowed: a finite number in column x"),
        ('{ fil = "pose.csv" }', "noise.pose.x.samples.fil: found 'fil'; allowed: column, file"),
        ("{ file = 3 }", "file: found 3; allowed: a string"),
        ('{ file = "long.csv", column = "x" }', "allowed: CSV (field larger than field limit"),
        ('{ file = "bare.csv" }', "line 1: found '0.36'; allowed: the column's name"),
        ('{ file = "twice.csv", column = "x" }', "line 1: found 'x'; allowed: the column's name, which no other has"),
    ],
)
def test_what_is_wrong_with_a_file_is_said(tmp_path, given, said):
    write(tmp_path / "pose.csv", ["0,0.1", "1,0.2"])
    write(tmp_path / "bad.csv", ["0,0.1", "1,much"])
    write(tmp_path / "nan.csv", ["0,nan"])
    write(tmp_path / "long.csv", ["0," + "1" * 200_000])
    write(tmp_path / "bare.csv", ["0.1", "0.2"], head="0.36")
    write(tmp_path / "twice.csv", ["0,0.1", "1,0.2"], head="x,x")
    with pytest.raises(InvalidValue) as told:
        loads(RUN + f"samples = {given}", folder=tmp_path)
    assert "noise.pose.x.samples" in str(told.value)
    assert said in str(told.value)


def test_of_more_errors_than_a_law_takes_quantiles_are_taken(tmp_path):
    errors = drawn(TWO, MAX_SAMPLES + 500)
    write(tmp_path / "pose.csv", [f"{k},{x}" for k, x in enumerate(errors)])
    law = loads(RUN + 'samples = { file = "pose.csv", column = "x" }', folder=tmp_path).noise.channels["pose.x"]
    assert len(law.samples) == MAX_SAMPLES
    levels = np.linspace(0.01, 0.99, 99)
    assert np.quantile(law.samples, levels) == pytest.approx(np.quantile(errors, levels), abs=2e-3)


def test_the_text_of_a_log_opens_no_file():
    with pytest.raises(InvalidValue, match="only a run file may name another file"):
        loads(RUN + 'samples = { file = "pose.csv", column = "x" }')


def test_weights_are_taken_with_the_digits_that_the_command_prints():
    rounded = Mixture(weights=(0.412982, 0.361616, 0.225401), means=(0.0, 1.0, 2.0), stds=(1.0, 1.0, 1.0))
    assert rounded.mean == pytest.approx((0.361616 + 2.0 * 0.225401) / 0.999999, abs=1e-15)


def test_the_command_prints_a_table_that_a_run_file_takes(tmp_path, capsys):
    file = write(tmp_path / "pose.csv", [f"{k},{x}" for k, x in enumerate(drawn(TWO, 500))])
    assert main(["noise", "fit", str(file), "--column", "x", "-o", str(tmp_path / "qq.png")]) == 0
    table = capsys.readouterr().out.partition("[noise.CHANNEL]")[2]
    text = RUN.partition("[noise.pose.x]")[0] + "[noise.pose.x]" + table
    assert loads(text).noise.channels["pose.x"].std == pytest.approx(drawn(TWO, 500).std(), rel=0.02)
    assert (tmp_path / "qq.png").read_bytes().startswith(b"\x89PNG")
    assert main(["noise", "fit", str(file), "--column", "x", "--json"]) == 0
    assert set(json.loads(capsys.readouterr().out)["laws"]) == {"pearson", "mixture", "empirical"}
    assert main(["noise", "fit", str(file)]) == 2
    assert "one of time, x" in capsys.readouterr().err
