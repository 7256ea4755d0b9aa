"""Tables fit the terminal and lose nothing; in a pipe a row is a line."""

import pytest

from mjnav.cli.terminal import streams, tables

HEADS = ("topic", "what", "Hz", "share")
ROWS = [
    ("/belief/robot", "the particles of the robot, with their weights", "12345.678", "17.4%"),
    ("/tf", "", "10.00", "0.1%"),
]


@pytest.mark.parametrize("columns", [60, 80, 120, 200])
def test_a_table_fits_the_terminal_and_breaks_no_number(monkeypatch, capsys, columns):
    made = streams.console
    monkeypatch.setattr(streams, "console", lambda **_: made(width=columns))
    monkeypatch.setattr(streams, "on_terminal", lambda: True)
    tables.print_table(ROWS, HEADS, numbers=(2, 3))
    out = capsys.readouterr().out
    assert max(map(len, out.splitlines())) <= columns
    words = out.replace(",", " ").split()
    for row in ROWS:
        assert {*row[0].split(), *row[1].replace(",", " ").split(), *row[2:]} <= {*words}


def test_in_a_pipe_a_row_is_a_line(capsys):
    tables.print_table([("x" * 300, "word " * 60 + "end", "1.5", "2.5")], HEADS, numbers=(2, 3))
    assert len(capsys.readouterr().out.splitlines()) == 2
