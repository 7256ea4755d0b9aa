"""Comparisons as text, CSV, JSON, LaTeX and HTML: the same figures in all of them, whatever the labels are.

Also: every table says whether its people see the robot, and how many layouts it has.
"""

import csv
import io
import json
import re
from functools import partial
from math import isfinite
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from mjnav.report.comparison.documents import csv_text, document, escaped, latex
from mjnav.report.comparison.forest import forest, pareto
from mjnav.report.comparison.html import html
from mjnav.report.comparison.shown import PLAIN, shown_tables
from mjnav.report.comparison.text import write
from mjnav.report.figure_text import Shown
from mjnav.study.compare.cell_rows import RATES, is_rate
from mjnav.study.compare.estimates import Estimate
from mjnav.study.compare.study_comparison import compare_study
from mjnav.study.store import Store
from mjnav.study.study_file import load_study, study_text
from tests.report.parsed_page import ParsedPage
from tests.study.made_up import row as episode

pytest.importorskip("pyarrow", reason="the sweep extra is not installed")

METHODS = ("rkhs", "saa", "mean", "never")
FIGURES = ("time_s", "control_cost", "min_clearance_m", "max_deviation_m")  # nothing defines the last
HOSTILE = (
    "[2pt] \\input{/etc/passwd} 100% $x$ a_b ~^&#{",
    '"></script><script>alert(1)</script><img src=x onerror=alert(2)>, "quoted"',
    "*red\x1b[31m\x1b[2J\nnext\rline\u202eturned [bold]走",
)
STUDY = """
schema = 1
name = "made up"
scenes = ["s", "t"]
seeds = { count = 30 }
methods = [{ controller = "rkhs" }, { controller = "saa" }, { controller = "mean" }, { controller = "never" }]
"""


@pytest.fixture(scope="module")
def results_of(tmp_path_factory):
    """Two scenes, the same seeds under every method; some runs collide, one fails, `never` collides in all."""

    def make(methods, *, study=STUDY, num=30, setting="default"):
        folder = tmp_path_factory.mktemp("results")
        store, rng = Store(folder), np.random.default_rng(0)
        base = rng.gamma(4.0, size=num)
        rows = [
            episode(
                method,
                seed,
                float(base[seed] + 0.8 * i + rng.normal(scale=0.1)),
                hit=i == 3 or (i > 0 and (seed + i) % 9 == 0),
                scene=scene,
                setting=setting,
                error="ZeroDivisionError: half way" if (i, seed) == (1, 4) else None,
            )
            for scene in "st"
            for i, method in enumerate(methods)
            for seed in range(num - 2 * (i == 2))
        ]
        with store.writing(study):
            store.append(rows)
        return compare_study(store, load_study(folder / "study.toml") if study else None, figures=FIGURES)

    return make


@pytest.fixture(scope="module")
def results(results_of):
    return results_of(METHODS)


@pytest.fixture(scope="module")
def hostile(results_of):
    return results_of(HOSTILE, study="", num=6, setting=HOSTILE[0])


def text(results, width=100, draw=write):
    file = io.StringIO()
    draw(results, Console(width=width, highlight=False, markup=False, emoji=False, file=file))
    return file.getvalue()


def check_rounded(shown, e, p, num, scale):
    """What is shown of an estimate is its value and interval, rounded to the decimals that it is shown with."""
    assert shown.marked == (p is not None and p < 0.05 and isfinite(e.value))
    assert shown.count == (f"({e.num})" if e.num != num else "")
    if not isfinite(e.value):
        assert (shown.value, shown.interval) == ("-", "")
        return
    half = 0.5 * 10.0 ** -len(shown.value.partition(".")[2]) * (1 + 1e-9)
    ends = [end for end in shown.interval.strip("[]").split(", ") if end]
    for printed, exact in zip((shown.value, *ends), (e.value, *(e.interval or ())), strict=True):
        assert float(printed) == pytest.approx(scale * exact, abs=half)


def check_ratio(shown, wins, num):
    """What is shown of a win ratio are three digits of its value and of the ends of its interval."""
    ends = shown.interval.strip("[]").split(", ")
    assert shown.marked == (wins.p < 0.05)
    assert shown.count == (f"({wins.pairs})" if wins.pairs != num else "")
    for printed, exact in zip((shown.value, *ends), (wins.value, *wins.interval), strict=True):
        assert printed == "∞" if exact == np.inf else float(printed) == pytest.approx(exact, rel=0.005, abs=5e-4)


def test_every_figure_of_every_method_is_shown_rounded(results):
    for table in results.tables:
        (shown,) = shown_tables(table)
        assert [column.figure for column in shown.columns] == ["episodes", *RATES, "win_ratio", *PLAIN, *FIGURES]
        assert shown.methods == METHODS
        for column in shown.columns[1:]:
            scale = 100.0 if is_rate(column.figure) or column.figure == "infeasible_share" else 1.0
            for row, cell in zip(table.rows, column.cells, strict=True):
                if column.figure == "win_ratio":
                    assert (str(cell.own) == "") == (row.wins is None)
                    if row.wins is not None:
                        check_ratio(cell.own, row.wins, row.num)
                elif column.figure in PLAIN:
                    plain = Estimate(row.plain[column.figure], None, row.num)
                    check_rounded(cell.own, plain, None, row.num, scale)
                else:
                    check_rounded(cell.own, row.figures[column.figure], None, row.num, scale)
                    assert (cell.below is None) == (row.method == table.reference)
                    if cell.below is not None:
                        change = row.differences[column.figure]
                        check_rounded(cell.below, change.estimate, change.p, row.num, scale)


def latex_rows(tabular):
    """The rows of a tabular, as cells."""
    lines = [line for line in tabular.splitlines() if line.endswith(r" \\")]
    return [re.split(r"(?<!\\)&", line.removesuffix(r" \\")) for line in lines]


def plain_text(row):
    """The cells of a row of LaTeX as a terminal has them."""
    signs = {r"\footnotesize ": "", "$-$": "-", "$^*$": "*", r"$\infty$": "∞", "{": "", "}": ""}
    return [re.sub("|".join(map(re.escape, signs)), lambda found: signs[found[0]], cell.strip()) for cell in row]


def test_text_page_and_latex_print_the_same_cells(results):
    blocks = text(results, width=1000).split("\n\n")[: len(results.tables)]
    figures = (div.text for div in ParsedPage(html(results)).all("div") if "data-value" in div.attributes)
    page = (" ".join(figure.replace("−", "-").replace("*", "").split()) for figure in figures)
    tex = map(plain_text, latex_rows(latex(results)))
    tex = (row for row in tex if row[0] != "method")
    for table, block in zip(results.tables, blocks, strict=True):
        (shown,) = shown_tables(table)
        title, header, *lines = block.splitlines()
        assert title.rstrip() == f"{table.scene}, {table.setting}; one layout; reference {table.reference}"
        assert re.split(" {2,}", header.strip()) == ["method", *(column.title.rstrip() for column in shown.columns)]
        words = re.split(" {2,}|\n", "  ".join(line.strip() for line in lines))
        cells = [part for _, row in shown.rows for cell in row for part in (cell.own, cell.below) if part]
        printed = [str(part) for part in cells if str(part)]
        assert sorted(words) == sorted([*printed, *METHODS])
        assert [next(page) for _ in cells] == [str(part).replace(" *", "") for part in cells]
        for _, row in shown.rows:
            for parts in ([cell.own for cell in row], [cell.below or Shown("") for cell in row]):
                if any(map(str, parts)):
                    assert next(tex)[1:] == [str(part).replace(" *", "*") for part in parts]
    assert next(page, None) is None


def in_document(estimate, count):
    """What the document says of an estimate; `count` is the name of its number."""
    low, high = estimate.interval or (None, None)
    return {
        "value": estimate.value if isfinite(estimate.value) else None,
        "low": low,
        "high": high,
        count: estimate.num,
    }


def test_the_document_has_every_figure_in_full_precision(results):
    listed = json.loads(json.dumps(document(results), allow_nan=False))
    for table, of_table in zip(results.tables, listed["tables"], strict=True):
        assert (of_table["scene"], of_table["reference"]) == (table.scene, table.reference)
        for row, of_row in zip(table.rows, of_table["methods"], strict=True):
            plain = {"method": row.method, "episodes": row.num, "failed": row.num_failed, **row.plain}
            assert plain.items() <= of_row.items()
            for figure, estimate in row.figures.items():
                values, change = of_row["figures"][figure], row.differences.get(figure)
                assert in_document(estimate, "n").items() <= values.items()
                if change is None:
                    assert values["difference"] is None
                else:
                    expected = {**in_document(change.estimate, "pairs"), "p_holm": change.p}
                    assert expected.items() <= values["difference"].items()
            if row.wins is not None:
                assert (of_row["win_ratio"]["value"], of_row["win_ratio"]["p_holm"]) == (row.wins.value, row.wins.p)
    assert (listed["episodes"], listed["missing"], listed["failed"]) == (236, 4, 2)
    assert listed["causes"] == {"ZeroDivisionError: half way": 2}


def test_the_csv_has_a_line_for_every_figure_of_the_document(results):
    lines = list(csv.DictReader(io.StringIO(csv_text(results))))
    by_key = {(line["scene"], line["method"], line["figure"]): line for line in lines}
    assert len(by_key) == len(lines) == 2 * len(METHODS) * (len(RATES) + len(FIGURES) + 3) + 2 * 3

    def check(line, values, **names):
        for key, name in names.items():
            value = None if values is None else values[key]
            assert line[name] == ("" if value is None else str(value))

    for table in document(results)["tables"]:
        for row in table["methods"]:
            for figure, values in row["figures"].items():
                line = by_key[table["scene"], row["method"], figure]
                check(line, values, value="value", low="low", high="high", n="n")
                check(line, values["difference"], value="difference", low="diff_low", high="diff_high", p_holm="p_holm")
                check(line, values["ratio"], value="ratio", low="ratio_low", high="ratio_high")
                assert line["reference"] == (table["reference"] if values["difference"] else "")
            if row["win_ratio"] is not None:
                keys = ("value", "low", "high", "wins", "losses", "ties", "win_share", "pairs", "p_holm")
                check(
                    by_key[table["scene"], row["method"], "win_ratio"], row["win_ratio"], **{key: key for key in keys}
                )


def test_what_is_missing_and_what_failed_is_told(results, hostile):
    told = " ".join(text(results, 2000).split())
    assert "Incomplete: 4 of the study's 240 episodes are missing." in told
    assert "2 episodes failed, and count in n alone: 2 × ZeroDivisionError: half way." in told
    assert "No study file is there" in text(hostile, 2000)
    assert "The fewest seeds of a cell are 4" in text(hostile, 2000)


def test_the_page_asks_for_nothing_and_runs_nothing_but_its_own(results, hostile):
    for each in (results, hostile):
        page = ParsedPage(html(each))
        attributes = [element.attributes for element in page.elements]
        assert not any("alert" in script for script in page.code)
        assert {element.tag for element in page.elements}.isdisjoint({"img", "iframe", "object", "form"})
        asked = [value for given in attributes for key, value in given.items() if key in ("href", "src", "action")]
        assert all(value.startswith(("#", "data:")) for value in asked)
        assert not [key for given in attributes for key in given if key.startswith("on") or key == "style"]
        assert page.policy.startswith("default-src 'none'; script-src 'sha256-")
        assert page.policy.count("sha256-") == len(page.code) + 1
        assert "unsafe" not in page.policy
        ids = [given["id"] for given in attributes if "id" in given]
        assert len(ids) == len(set(ids))
        assert {value[1:] for value in asked if value.startswith("#")} <= set(ids)


def test_the_page_says_how_it_was_made_and_leads_to_the_worst_seeds(tmp_path):
    study = load_study("crossings")
    text = "# mjnav sweep crossings --set robot.radius=0.3\n" + study_text(study)
    store, log = Store(tmp_path / "results"), "logs/crossing1-pearson-saa-7-0123456789abcdef.mcap"
    place = {"scene": "crossing1", "setting": "pearson", "study": study.name}
    place |= {"controller": "saa", "control": '{"weight": 2.0}'}
    ends: list[dict[str, Any]] = [{"hit": True}, {"hit": True, "log": log}, {"error": "ZeroDivisionError: half way"}]
    other: dict[int, dict[str, Any]] = dict(zip((3, 5, 7), ends, strict=True))
    rows = [episode("saa", seed, 1.0 + seed, id=f"{seed:064d}", **place, **other.get(seed, {})) for seed in range(9)]
    with store.writing(text):
        store.append(rows)
    results = compare_study(store, study, figures=FIGURES)

    def shown():
        return html(results, study, page=tmp_path / "page.html")

    page = shown()
    assert 'title="control_cost: ' in page
    assert "control cost <span>[m²/s³]</span>" in page
    assert "&quot;weight&quot;: 2.0" in page
    assert "robot.radius=0.3" in page.partition("Study file")[2]
    worst = page.partition("Worst seeds")[2].partition("</table>")[0]
    seeds = re.findall(r'<td data-value="(\d+)">\d+</td><td>([^<]*)</td><td>(.*?)</td>', worst)
    assert [(seed, why) for seed, why, _ in seeds] == [
        ("7", "failed: ZeroDivisionError: half way"),
        ("3", "touched a person"),
        ("5", "touched a person"),
    ]
    command = "mjnav run crossing1 --controller saa --set physics.engine=kinematic --set noise.profile=pearson"
    command += " --set robot.radius=0.3 --seed 3 --log seed3.mcap"
    assert seeds[1][2] == f"<code>{command}</code>"
    kept = tmp_path / "results" / log
    kept.parent.mkdir()
    kept.write_bytes(b"")
    assert f"<code>mjnav report {kept}</code>" in shown()
    kept.with_suffix(".html").write_text("")
    assert f'<a href="./results/{log.removesuffix(".mcap")}.html">report</a>' in shown()


@pytest.mark.parametrize("draw", [forest, partial(pareto, cost="control_cost")])
def test_panels_of_one_scene_are_told_apart_by_their_settings(results, tmp_path, draw):
    assert [axes.get_title() for axes in draw(results).axes] == ["s\nn = 30", "t\nn = 30"]
    store = Store(tmp_path)
    store.append([episode("rkhs", 0, 1.0, scene="s", setting=setting) for setting in ("loud", "plain")])
    titles = [axes.get_title() for axes in draw(compare_study(store, None)).axes]
    assert titles == ["s\nloud\nn = 1", "s\nplain\nn = 1"]


def test_hostile_labels_are_text_everywhere(hostile):
    inert = [re.sub("[\x1b\n\r\u202e]", "\N{REPLACEMENT CHARACTER}", label) for label in HOSTILE]
    assert {head.text for head in ParsedPage(html(hostile)).all("th", scope="row")} == set(inert)
    printed = text(hostile, 2000)
    assert all(label in printed for label in inert)
    assert not set(printed) & set("\x1b\r\u202e")
    methods = {line["method"] for line in csv.DictReader(io.StringIO(csv_text(hostile), newline=""))}
    assert methods == set(HOSTILE)
    assert {m["method"] for m in document(hostile)["tables"][0]["methods"]} == set(HOSTILE)


def test_latex_tables_have_one_cell_a_column_and_balanced_braces(results, hostile):
    for each in (results, hostile):
        source = latex(each)
        assert source.isprintable() or set(filter(lambda c: not c.isprintable(), source)) == {"\n"}
        body = "\n".join(line for line in source.splitlines() if not line.startswith("%"))
        stack = []
        for kind, name in re.findall(r"\\(begin|end)\{(\w+)\}", body):
            if kind == "begin":
                stack.append(name)
            else:
                assert stack.pop() == name
        assert stack == []
        bare = re.sub(r"\\[{}$&#_%\\]", "", body)
        assert bare.count("{") == bare.count("}")
        assert bare.count("$") % 2 == 0
        assert "%" not in bare
        tabulars = re.findall(r"\\begin\{tabular\}\{@\{\}(lr*)@\{\}\}(.*?)\\end\{tabular\}", body, re.S)
        assert len(tabulars) == len(each.tables)
        for aligned, tabular in tabulars:
            rows = latex_rows(tabular)
            assert {len(cells) for cells in rows} == {len(aligned)}
            # After \\ and \midrule an opening bracket or a star would be an option.
            assert not re.search(r"(\\\\|rule)\s*[\[*]", tabular)


LABELLED = """
schema = 1
name = "made up"
scenes = ["s", "t"]
seeds = { count = 30 }
settings = [{ name = "default", label = "As it is" }]
methods = [
    { controller = "rkhs", label = "Ours, 50 %" },
    { controller = "my_controllers.py:WaitAndSee" },
    { controller = "other/controllers.py:Twin" },
    { controller = "more/controllers.py:Twin" },
]
"""
PLUGINS = tuple(re.findall('controller = "(.*?)"', LABELLED))


def test_people_read_labels_and_the_class_of_a_plug_in_unless_two_classes_have_one_name(results_of):
    labelled = results_of(PLUGINS, study=LABELLED)
    shown = ["Ours, 50 %", "WaitAndSee", *PLUGINS[2:]]
    printed = text(labelled, width=1000)
    assert printed.startswith("s, As it is; one layout; reference Ours, 50 %\n")
    assert all(f"\n{label} " in printed for label in shown)
    assert not any(name in printed for name in PLUGINS[:2])
    assert escaped(PLUGINS[1]) not in latex(labelled)
    assert r"{Ours, 50 \%}" in latex(labelled)
    page = html(labelled)
    assert "differences from Ours, 50 %" in page
    assert all(f'<th scope="row">{label}</th>' in page for label in shown)


def test_every_form_says_whether_people_see_the_robot_and_how_many_layouts_there_are(tmp_path):
    """One scene in which nobody sees the robot, one in which all do, one without people; the first draws 2 layouts."""
    store = Store(tmp_path)
    with store.writing(""):
        store.append(
            [episode("rkhs", seed, 1.0 + seed, scene=scene, people_see_robot=see,
                     layout=f"reporting {seed // 2}" if scene == "blind" else None)
             for scene, see in (("blind", "none"), ("seeing", "all"), ("empty", None)) for seed in range(4)]
        )  # fmt: skip
    results = compare_study(store, None, figures=["time_s"])
    assert [line for line in text(results, 200).splitlines() if line.endswith("reference rkhs")] == [
        "blind, default; 2 layouts; people do not see the robot; reference rkhs",
        "empty, default; one layout; reference rkhs",
        "seeing, default; one layout; people see the robot; reference rkhs",
    ]
    assert "<small>2 layouts; people do not see the robot; differences from rkhs</small>" in html(results)
    assert r"\caption{seeing, default; one layout; people see the robot: rates" in latex(results)
    tables = document(results)["tables"]
    assert [(table["people_see_robot"], table["layouts"]) for table in tables] == [("none", 2), (None, 1), ("all", 1)]
