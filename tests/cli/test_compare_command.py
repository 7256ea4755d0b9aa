"""`mjnav compare`: where it looks for results, what it prints and writes, and what it refuses."""

import csv
import json

import pytest

from mjnav.study.store import Store
from tests.study.made_up import row

pytest.importorskip("pyarrow", reason="the sweep extra is not installed")

STUDY = """
schema = 1
name = "two methods"
scenes = ["crossing1"]
seeds = { count = 25 }
[[methods]]
controller = "rkhs"
[[methods]]
controller = "mean"
"""


def fill(folder, study="two methods", num=25):
    store = Store(folder)
    rows = [
        row(method, seed, 1.0 + 0.01 * (7 * seed % 25) + i, hit=i == 1 and seed < 5, scene="crossing1", study=study)
        for i, method in enumerate(("rkhs", "mean"))
        for seed in range(num)
    ]
    with store.writing(STUDY.replace("two methods", study)):
        store.append(rows)
    return store


@pytest.fixture
def study(tmp_path):
    """The study's file, and its results where a sweep leaves them."""
    (tmp_path / "two.toml").write_text(STUDY)
    return fill(tmp_path / "runs/out/two methods")


def test_a_study_is_found_by_its_file_its_name_and_its_folder(mjnav, study):
    said = mjnav("compare", "two.toml")
    assert (said.code, said.err) == (0, "")
    title, header, rkhs, mean, difference = said.out.splitlines()[:5]
    assert title == "crossing1, default; one layout; reference rkhs"
    assert header.split()[:6] == ["method", "n", "success", "%", "collision", "%"]
    assert rkhs.split()[:5] == ["rkhs", "25", "100", "[87,", "100]"]
    assert mean.split()[:5] == ["mean", "25", "80", "[61,", "91]"]
    assert difference.split()[:3] == ["-20", "[-36,", "-4]"]
    for name in ("two methods", "runs/out/two methods", "runs/out/two methods/"):
        assert mjnav("compare", name).out == said.out


def test_files_are_written_by_their_names(mjnav, study, tmp_path):
    said = mjnav("compare", "two.toml", "-o", "t.csv", "-o", "t.tex", "-o", "t.html", "-o", "t.svg", "-o", "t.pdf")
    assert [line.split(":")[0] for line in said.out.splitlines()[-5:]] == ["t.csv", "t.tex", "t.html", "t.svg", "t.pdf"]
    assert (tmp_path / "t.pdf").read_bytes().startswith(b"%PDF")
    assert (tmp_path / "t.svg").read_text().count("<!-- crossing1 -->") == 1
    with open("t.csv", newline="") as file:
        lines = list(csv.DictReader(file))
    assert len(lines) == 2 * (2 + 3 + 3) + 1  # the rows have three of the default figures; one win ratio
    assert (tmp_path / "t.tex").read_text().count(r"\begin{tabular}") == 1
    assert (tmp_path / "t.html").read_text().startswith("<!doctype html>")
    quiet = mjnav("compare", "two.toml", "--json", "-o", "again.csv")
    printed = json.loads(quiet.out)
    assert (printed["schema"], printed["folder"], printed["episodes"]) == (1, "runs/out/two methods", 50)
    assert (tmp_path / "again.csv").read_bytes() == (tmp_path / "t.csv").read_bytes()


def test_a_picture_over_a_cost_names_both_methods_and_the_cost(mjnav, study, tmp_path):
    assert mjnav("compare", "two.toml", "--pareto", "control_cost", "-o", "p.svg").code == 0
    text = (tmp_path / "p.svg").read_text()
    assert all(
        f"<!-- {name} -->" in text for name in ("rkhs", "mean", "control cost, ratio to rkhs over common successes")
    )
    no_cost = mjnav("compare", "two.toml", "--pareto", "success", "-o", "p.svg")
    assert (no_cost.code, "--pareto: found 'success'; allowed: a cost" in no_cost.err) == (2, True)
    assert "--pareto is for pictures" in mjnav("compare", "two.toml", "--pareto", "control_cost").err


def test_a_damaged_shard_is_told_in_a_line(mjnav, study, tmp_path):
    shard = next((tmp_path / "runs/out/two methods").glob("part-*.parquet"))
    shard.write_bytes(shard.read_bytes()[:-1])
    said = mjnav("compare", "two.toml")
    assert (said.code, said.out) == (1, "")
    assert f"{shard.name}: damaged (" in said.err


def test_two_folders_are_compared_seed_by_seed_in_text_and_json(mjnav, study, tmp_path):
    after = fill(tmp_path / "after", num=20)
    after.append([row("kld", 0, 1.0, scene="crossing1", study="two methods")])
    said = mjnav("compare", "two methods", after.folder)
    assert (said.code, said.err) == (0, "")
    assert "Of 40 pairs 0 are better, 0 worse, 0 failed otherwise" in said.out
    assert "Only after: crossing1, default, kld." in said.out
    assert "crossing1, default, mean: 25 seeds before, 20 after, 20 in both." in said.out
    printed = json.loads(mjnav("compare", "two methods", after.folder, "--json").out)
    assert {cell["method"] for cell in printed["cells"]} == {"rkhs", "mean"}
    assert printed["only_after"] == [{"scene": "crossing1", "setting": "default", "method": "kld"}]


def test_a_requirement_that_is_not_met_is_a_line_and_exit_1(mjnav, study):
    met = mjnav("compare", "two.toml", "--require", "rkhs: success>=1", "--require", "mean: collision<0.21")
    assert (met.code, met.err) == (0, "")
    said = mjnav("compare", "two.toml", "--json", "--require", "success>=0.9", "--require", "rkhs: ticks<=5")
    assert said.code == 1
    assert said.err.splitlines() == [
        "mjnav: required crossing1, default, mean: success >= 0.9; found 0.8",
        "mjnav: required crossing1, default, rkhs: ticks <= 5; found 10",
    ]
    found = json.loads(said.out)["requirements"]
    assert [(one["method"], one["found"], one["met"]) for one in found] == [
        ("rkhs", 1.0, True),
        ("mean", 0.8, False),
        ("rkhs", 10.0, False),
    ]
