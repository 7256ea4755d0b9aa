"""Tables and text fit the terminal and lose nothing; in a pipe a row is a line."""

import pytest

from mjnav.cli.terminal import streams, tables

HEADS = ("topic", "what", "Hz", "share")
ROWS = [
    ("/belief/robot", "the particles of the robot, with their weights", "12345.678", "17.4%"),
    ("/tf", "", "10.00", "0.1%"),
]


@pytest.fixture
def printed(monkeypatch, capsys):
    def at(columns, draw):
        made = streams.console

        def console(**_):
            console = made(width=columns)
            console.width = columns
            return console

        monkeypatch.setattr(streams, "console", console)
        monkeypatch.setattr(streams, "on_terminal", lambda: True)
        draw()
        return capsys.readouterr().out

    return at


@pytest.mark.parametrize("columns", [40, 60, 80, 120, 200])
def test_a_table_fits_and_breaks_no_number(printed, columns):
    out = printed(columns, lambda: tables.print_table(ROWS, HEADS, numbers=(2, 3)))
    assert max(map(len, out.splitlines())) <= columns
    assert "…" not in out
    words = out.replace(",", " ").split()
    for row in ROWS:
        assert {*row[0].split(), *row[1].replace(",", " ").split(), *row[2:]} <= {*words}


def test_in_a_pipe_a_row_is_a_line(capsys):
    rows = [("x" * 300, "word " * 60 + "end", "1.5", "2.5")]
    tables.print_table(rows, HEADS, numbers=(2, 3))
    assert len(capsys.readouterr().out.splitlines()) == 2
    tables.print_lines([f"  name  {'word ' * 100}"])
    assert len(capsys.readouterr().out.splitlines()) == 1


def test_a_line_goes_on_below_its_second_column(printed):
    out = printed(24, lambda: tables.print_lines(["  rate    50 Hz achieved, 100 ticks", "short"]))
    assert out == "  rate    50 Hz\n          achieved, 100\n          ticks\nshort\n"


def test_a_line_of_a_million_blanks_is_no_work(printed):
    assert len(printed(60, lambda: tables.print_lines(["  x" + " " * 10**6]))) < 100
