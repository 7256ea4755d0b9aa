"""Comparisons as text, CSV, JSON, LaTeX and HTML: the same figures in all of them, whatever the labels are."""

import csv
import io
import json
import re
import shutil
import subprocess
from html.parser import HTMLParser
from math import isfinite

import numpy as np
import pytest
from rich.cells import cell_len
from rich.console import Console

from mjnav.report.comparison.forest import CHARACTER, Forest, ForestRow, forest_svg, forests
from mjnav.report.comparison.html import background, html
from mjnav.report.comparison.latex import escaped, latex
from mjnav.report.comparison.shown import shown_table
from mjnav.report.comparison.text import write
from mjnav.report.comparison.tidy import csv_text, document
from mjnav.study.compare.chosen_figures import RATES
from mjnav.study.compare.estimates import Estimate
from mjnav.study.compare.study_comparison import compare_study
from mjnav.study.store.store import Store
from mjnav.study.study_file import load_study, study_text
from tests.study.made_up import row

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
            row(
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


def text(results, width=100):
    file = io.StringIO()
    write(results, Console(width=width, highlight=False, markup=False, emoji=False, file=file))
    return file.getvalue()


def numbers(shown):
    """Value, interval, count and mark of a printed figure."""
    found = re.fullmatch(r"(\S+)(?: \[(\S+), (\S+)\])?(?: \((\d+)\))?( \*)?", shown)
    assert found, shown
    value, low, high, count, mark = found.groups()
    return value, (low, high) if low else None, int(count) if count else None, bool(mark)


def check_printed(shown, e, p, num, scale):
    """A printed figure is the estimate rounded to the decimals that it is printed with."""
    value, interval, count, mark = numbers(shown)
    assert mark == (p is not None and p < 0.05)
    assert count == (e.num if e.num != num else None)
    if not isfinite(e.value):
        assert (value, interval) == ("-", None)
        return
    half = 0.5 * 10.0 ** -len(value.partition(".")[2]) * (1 + 1e-9)
    for printed, exact in zip((value, *(interval or ())), (e.value, *(e.interval or ())), strict=True):
        assert float(printed) == pytest.approx(scale * exact, abs=half)


def check_ratio(shown, wins, num):
    """A printed win ratio has three digits of its value and of the ends of its interval."""
    if wins is None:
        assert shown == ""
        return
    value, interval, count, mark = numbers(shown)
    assert interval is not None
    assert mark == (wins.p < 0.05)
    assert count == (wins.pairs if wins.pairs != num else None)
    for printed, exact in zip((value, *interval), (wins.value, *wins.interval), strict=True):
        assert printed == "∞" if exact == np.inf else float(printed) == pytest.approx(exact, rel=0.005, abs=5e-4)


def printed_rows(lines, titles):
    """Cells by title of the lines below a header, whose columns start where the titles do."""
    starts = [lines[0].index(title) for title in titles]
    ends = [*starts[1:], None]
    return [{t: line[a:b].strip() for t, a, b in zip(titles, starts, ends, strict=True)} for line in lines[1:]]


def test_the_text_has_every_figure_of_every_method_rounded(results):
    blocks = text(results, width=1000).split("\n\n")[: len(results.tables)]
    plain = ["infeasible %", "decision ms", "decision p99 ms"]
    titles = ["method", "n", "success %", "collision %", "win_ratio", *plain, *FIGURES]
    for table, block in zip(results.tables, blocks, strict=True):
        title, *lines = block.splitlines()
        assert title.rstrip() == f"{table.scene}, {table.setting}; one layout; reference {table.reference}"
        lines = iter(printed_rows(lines, titles))
        for method in table.rows:
            own = next(lines)
            assert own["method"] == method.method
            assert own["infeasible %"] == f"{100 * method.infeasible_share:.1f}"
            assert own["decision ms"] == f"{method.decision_ms:.2f}"
            assert own["decision p99 ms"] == f"{method.decision_p99_ms:.2f}"
            check_ratio(own["win_ratio"], method.wins, method.num)
            below = next(lines) if method.differences else {}
            for figure, e in method.figures.items():
                title, scale = (f"{figure} %", 100.0) if figure in RATES else (figure, 1.0)
                check_printed(own[title], e, None, method.num, scale)
                if method.differences:
                    d = method.differences[figure]
                    check_printed(below[title], d.estimate, d.p, method.num, scale)
        assert next(lines, None) is None


def test_what_is_rounded_by_hand_is_printed_so(results):
    first, second, *_ = (row.cells[0] for row in shown_table(results, results.tables[0]).rows)
    assert first.figure == "success"
    assert str(first.own) == "100 [89, 100]"  # 30 of 30
    assert str(second.own) == "90 [74, 96] (29)"  # all but 8, 17, 26; 4 failed
    assert first.below is None


@pytest.mark.parametrize("width", [60, 80, 100, 160])
def test_no_line_is_wider_than_the_terminal_and_nothing_is_lost(results, hostile, width):
    for each in (results, hostile):
        wide = set(re.findall(r"\S+ \[[^]\s]+, \S+\](?: \(\d+\))?(?: \*)?", text(each, width=2000)))
        printed = text(each, width)
        assert max(cell_len(line) for line in printed.splitlines()) <= width
        assert not {figure for figure in wide if figure not in printed}


def test_a_column_has_the_decimals_of_its_narrowest_interval(results):
    methods = shown_table(results, results.tables[0]).rows
    for column in zip(*(method.cells for method in methods), strict=True):
        if column[0].figure not in ("time_s", "control_cost"):
            continue
        differences = [cell.difference.estimate for cell in column[1:]]
        intervals = [e.interval for e in (*(cell.estimate for cell in column), *differences) if e.interval]
        assert len(intervals) == 3 + 2  # nothing is known of the last method
        decimals = len(column[0].own.value.partition(".")[2])
        assert 1.0 <= min(0.5 * (high - low) for low, high in intervals) * 10.0**decimals < 10.0


def test_the_csv_has_a_line_for_every_figure_in_full_precision(results):
    lines = list(csv.DictReader(io.StringIO(csv_text(results))))
    by_key = {(line["scene"], line["method"], line["figure"]): line for line in lines}
    assert len(by_key) == len(lines) == 2 * len(METHODS) * (len(RATES) + len(FIGURES) + 3) + 2 * 3

    def same(found, exact):
        assert found == ("" if exact is None or not isfinite(exact) else repr(exact))

    for table in results.tables:
        for method in table.rows:
            for figure, e in method.figures.items():
                line = by_key[table.scene, method.method, figure]
                same(line["value"], e.value)
                for name, end in zip(("low", "high"), e.interval or (None, None), strict=True):
                    same(line[name], end)
                assert (line["n"], line["episodes"]) == (str(e.num), str(method.num))
                assert line["failed"] == str(method.num_failed)
                if figure not in method.differences:
                    assert [line[key] for key in ("reference", "difference", "pairs", "p_holm")] == [""] * 4
                    continue
                d = method.differences[figure]
                assert (line["reference"], line["pairs"]) == (table.reference, str(d.estimate.num))
                same(line["difference"], d.estimate.value)
                for name, end in zip(("diff_low", "diff_high"), d.estimate.interval or (None, None), strict=True):
                    same(line[name], end)
                same(line["p_holm"], d.p)
            assert by_key[table.scene, method.method, "decision_ms"]["value"] == repr(method.decision_ms)
            if method.wins is not None:
                line = by_key[table.scene, method.method, "win_ratio"]
                same(line["value"], method.wins.value)
                same(line["p_holm"], method.wins.p)
                assert [line[key] for key in ("wins", "losses", "ties")] == [
                    str(num) for num in (method.wins.wins, method.wins.losses, method.wins.ties)
                ]
            assert by_key[table.scene, method.method, "infeasible_share"]["value"] == repr(method.infeasible_share)
    assert {line["missing"] for line in lines if line["method"] == "mean"} == {"2"}


def test_the_document_has_the_same(results):
    found = json.loads(json.dumps(document(results), allow_nan=False))
    for table, listed in zip(results.tables, found["tables"], strict=True):
        assert (listed["scene"], listed["reference"]) == (table.scene, table.reference)
        for method, one in zip(table.rows, listed["methods"], strict=True):
            assert (one["method"], one["episodes"], one["failed"]) == (method.method, method.num, method.num_failed)
            for figure, e in method.figures.items():
                assert one["figures"][figure]["value"] == (e.value if isfinite(e.value) else None)
                d = method.differences.get(figure)
                assert (one["figures"][figure]["difference"] is None) == (d is None)
                if d is not None:
                    assert one["figures"][figure]["difference"]["p_holm"] == d.p
    assert (found["episodes"], found["missing"], found["failed"]) == (236, 4, 2)
    assert found["causes"] == {"ZeroDivisionError: half way": 2}


def test_what_is_missing_and_what_failed_is_told(results, hostile):
    told = " ".join(text(results, 2000).split())
    assert "Incomplete: 4 of the study's 240 episodes are missing, 2 of 30 seeds in 2 of 8 cells." in told
    assert "2 episodes failed, and count in n alone: 2 × ZeroDivisionError: half way." in told
    assert "28/30" in told
    assert "30 (1 failed)" in told
    assert "No study file is there" in text(hostile, 2000)
    assert "The fewest seeds of a cell are 4" in text(hostile, 2000)


class Page(HTMLParser):
    """The table cells of a page, and whether its tags are balanced."""

    def __init__(self, page):
        super().__init__()
        self.open, self.tags, self.cells, self.labels = [], [], [], []
        self._in_label = self._in_figure = False
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        attributes = dict(attrs)
        self.tags.append((tag, attributes))
        self._in_label = (tag, attributes.get("scope")) == ("th", "row")
        if tag == "td":
            self.cells.append([attributes, []])
        elif tag == "div" and "data-value" in attributes:
            self.cells[-1][1].append([attributes, ""])
            self._in_figure = True
        elif self._in_label:
            self.labels.append("")
        if tag not in ("meta", "link"):
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        assert self.open.pop() == tag
        self._in_figure = self._in_figure and tag != "div"

    def handle_data(self, data):
        if self.open[-1:] == ["th"] and self._in_label:
            self.labels[-1] += data
        elif self._in_figure:
            self.cells[-1][1][-1][1] += data


def in_order(printed, mark):
    """What a page prints of a figure, with the mark at its end as in a terminal."""
    return " ".join(printed.replace("−", "-").replace("*", "").split()) + " *" * mark


def test_the_page_has_every_figure_printed_and_in_full_precision(results):
    cells = iter(cell for cell in Page(html(results)).cells if "data-figure" in cell[0])
    plain = ("infeasible_share", "decision_ms", "decision_p99_ms")
    order = [*RATES, "win_ratio", *plain, *FIGURES]
    for table in results.tables:
        for method in table.rows:
            for figure in order:
                attributes, parts = next(cells)
                assert attributes["data-figure"] == figure
                if figure in plain:
                    assert float(attributes["data-value"]) == getattr(method, figure)
                    continue
                if figure == "win_ratio":
                    if method.wins is None:
                        assert (attributes["data-value"], parts) == ("", [])
                    else:
                        printed = parts[0][1]
                        check_ratio(in_order(printed, "*" in printed), method.wins, method.num)
                    continue
                scale = 100.0 if figure in RATES else 1.0
                d = method.differences.get(figure)
                estimates = [method.figures[figure]] + ([d.estimate] if d else [])
                for i, (e, (raw, printed)) in enumerate(zip(estimates, parts, strict=True)):
                    mark = bool(i) and "*" in printed
                    check_printed(in_order(printed, mark), e, d.p if d and i else None, method.num, scale)
                    assert raw["data-value"] == (repr(e.value) if isfinite(e.value) else "")
                    assert raw["data-low"] == ("" if e.interval is None else repr(e.interval[0]))
    assert next(cells, None) is None


def test_the_page_asks_for_nothing_and_runs_nothing_but_its_own(results, hostile):
    for each in (results, hostile):
        page = html(each)
        scripts = re.findall("<script>(.*?)</script>", page, re.S)
        assert not [script for script in scripts if "alert" in script]
        found = Page(page)
        assert found.open == []
        assert {tag for tag, _ in found.tags}.isdisjoint({"img", "iframe", "object", "form"})
        asked = [value for _, a in found.tags for key, value in a.items() if key in ("href", "src", "action")]
        assert all(value.startswith(("#", "data:")) for value in asked)
        assert not [key for _, a in found.tags for key in a if key.startswith("on") or key == "style"]
        (policy,) = [a["content"] for tag, a in found.tags if a.get("http-equiv") == "Content-Security-Policy"]
        assert policy.startswith("default-src 'none'; script-src 'sha256-")
        assert policy.count("sha256-") == len(scripts) + 1
        assert "unsafe" not in policy
        ids = [a["id"] for _, a in found.tags if "id" in a]
        assert len(ids) == len(set(ids))
        assert {value[1:] for value in asked if value.startswith("#")} <= set(ids)


def test_headings_have_words_units_and_the_name_that_an_option_takes(results):
    headings = [a for tag, a in Page(html(results)).tags if tag == "th" and a.get("scope") == "col"]
    titles = [a["title"] for a in headings if "title" in a]
    for figure in (*RATES, "win_ratio", "infeasible_share", "decision_ms", "decision_p99_ms", *FIGURES):
        assert [len(title) > len(figure) + 5 for title in titles if title.startswith(f"{figure}: ")] == [True] * 2, (
            figure
        )
    assert "control cost <span>[m²/s³]</span>" in html(results)


def test_a_chart_draws_the_intervals_of_the_table(results):
    table = results.tables[0]
    drawn = {forest.title: forest for forest in forests(table, results.figures)}
    assert list(drawn) == [
        "success [%]",
        "collision [%]",
        "time to the goal [s]",
        "control cost [m²/s³]",
        "least clearance [m]",
    ]  # nothing is known of the greatest deviation
    for one in drawn["control cost [m²/s³]"].rows:
        (method,) = (method for method in table.rows if method.method == one.label)
        difference = method.differences["control_cost"]
        assert one.estimate == difference.estimate
        assert one.marked == (difference.p is not None and difference.p < 0.05)
    svg = forest_svg(drawn["success [%]"])
    lines = re.findall(r'class="interval" x1="([\d.]+)" x2="([\d.]+)"', svg)
    points = re.findall(r'<circle cx="([\d.]+)"', svg)
    assert len(lines) == len(points) == 4
    for (low, high), point, method in zip(lines, points, table.rows, strict=True):
        assert float(low) <= float(point) <= float(high) <= 350.0
        (a, b), value = method.figures["success"].interval, method.figures["success"].value
        assert float(point) - float(low) == pytest.approx((float(high) - float(low)) * (value - a) / (b - a), abs=0.11)


def test_the_page_says_how_it_was_made_and_leads_to_the_worst_seeds(tmp_path):
    study = load_study("crossings")
    text = "# mjnav sweep crossings --set robot.radius=0.3\n" + study_text(study)
    store, log = Store(tmp_path / "results"), "logs/crossing1-pearson-saa-7-0123456789abcdef.mcap"
    rows = [
        row(
            "saa",
            seed,
            1.0 + seed,
            hit=seed in (3, 5),
            scene="crossing1",
            setting="pearson",
            study=study.name,
            control='{"weight": 2.0}',
            id=f"{seed:064d}",
            log=log if seed == 5 else None,
            error="ZeroDivisionError: half way" if seed == 7 else None,
        )
        for seed in range(9)
    ]
    with store.writing(text):
        store.append(rows)
    results = compare_study(store, study, figures=FIGURES)

    def shown():
        found = background(store, study, results, page=tmp_path / "page.html", made="on 2026-01-02 by mjnav 1")
        assert html(results, found) == html(results, found)
        return html(results, found)

    page = shown()
    assert "Page made on 2026-01-02 by mjnav 1" in page
    assert "weight = 2.0" in page
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


def test_hostile_labels_are_text_everywhere(hostile):
    inert = [re.sub("[\x1b\n\r\u202e]", "\N{REPLACEMENT CHARACTER}", label) for label in HOSTILE]
    assert set(Page(html(hostile)).labels) == set(inert)
    printed = text(hostile, 2000)
    assert all(label in printed for label in inert)
    assert not set(printed) & set("\x1b\r\u202e")
    methods = {line["method"] for line in csv.DictReader(io.StringIO(csv_text(hostile), newline=""))}
    assert methods == set(HOSTILE)
    assert {m["method"] for m in document(hostile)["tables"][0]["methods"]} == set(HOSTILE)


def latex_rows(tabular):
    """The rows of a tabular, as cells."""
    lines = [line for line in tabular.splitlines() if line.endswith(r" \\")]
    return [re.split(r"(?<!\\)&", line.removesuffix(r" \\")) for line in lines]


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
    { controller = "my_controllers.py:WaitForAll" },
    { controller = "other/controllers.py:Twin" },
    { controller = "more/controllers.py:Twin" },
]
"""
PLUGINS = (
    "rkhs",
    "my_controllers.py:WaitAndSee",
    "my_controllers.py:WaitForAll",
    "other/controllers.py:Twin",
    "more/controllers.py:Twin",
)


@pytest.fixture(scope="module")
def labelled(results_of):
    return results_of(PLUGINS, study=LABELLED)


def test_people_read_labels_and_the_class_of_a_plug_in_unless_two_classes_have_one_name(labelled):
    shown = ["Ours, 50 %", "WaitAndSee", "WaitForAll", *PLUGINS[3:]]
    printed = text(labelled, width=1000)
    assert printed.startswith("s, As it is; one layout; reference Ours, 50 %\n")
    assert all(f"\n{label} " in printed for label in shown)
    assert not any(name in printed for name in PLUGINS[:3])
    assert not any(name in latex(labelled) for name in map(escaped, PLUGINS[1:3]))
    assert r"{Ours, 50 \%}" in latex(labelled)
    page = html(labelled)
    assert "differences from Ours, 50 %" in page
    assert all(f'<th scope="row">{label}</th>' in page for label in shown)
    assert all(f"<td>{label}</td>" in labelled._repr_html_() for label in shown)


def test_programs_read_names_with_the_labels_beside_them(labelled):
    lines = list(csv.DictReader(io.StringIO(csv_text(labelled))))
    assert {(line["method"], line["method_label"]) for line in lines} >= {
        ("rkhs", "Ours, 50 %"),
        ("my_controllers.py:WaitAndSee", "WaitAndSee"),
    }
    assert {(line["setting"], line["setting_label"]) for line in lines} == {("default", "As it is")}
    assert {line["reference"] for line in lines} == {"", "rkhs"}
    (table, _) = document(labelled)["tables"]
    assert (table["setting"], table["setting_label"], table["reference"]) == ("default", "As it is", "rkhs")
    assert [row["method"] for row in table["methods"]] == list(PLUGINS)
    assert table["methods"][0]["method_label"] == "Ours, 50 %"


def test_a_chart_tells_long_labels_apart():
    labels = [f"mine.py:Controller weight={weight} horizon={horizon}" for weight in (1, 10) for horizon in (2.0, 4.0)]
    forest = Forest("time", "", tuple(ForestRow(label, Estimate(1.0, (0.5, 1.5), 9)) for label in labels))
    drawn = re.findall(r'<text class="label"[^>]*>([^<]*)</text>', forest_svg(forest))
    assert len(set(drawn)) == len(labels)
    assert max(map(len, drawn)) * CHARACTER <= forest.label_width


def test_latex_escapes_what_it_would_read():
    assert escaped(r"a_b & 50% \x {~^} #1 $2") == (
        r"a\_b \& 50\% \textbackslash{}x \{\textasciitilde{}\textasciicircum{}\} \#1 \$2"
    )


@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="pdflatex is not installed")
def test_latex_compiles_and_is_no_wider_than_the_line(hostile, tmp_path):
    preamble = r"\documentclass{article}\usepackage[T1]{fontenc}\usepackage{booktabs,graphicx}"
    body = latex(hostile).replace("走", "")
    (tmp_path / "a.tex").write_text(f"{preamble}\\begin{{document}}\n{body}\\end{{document}}\n")
    command = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "a.tex"]
    done = subprocess.run(command, cwd=tmp_path, check=True, capture_output=True, timeout=60)
    assert b"Output written on a.pdf" in done.stdout
    assert b"Overfull" not in done.stdout
