"""Recordings as text: every format, every order, and what is no recording."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mjnav.errors import InvalidValue
from mjnav.scenarios.crowd.reader import read_recording

ROWS = [(frame, person, 0.5 * person + 0.05 * frame, -1.25 * person) for person in (3, 1) for frame in range(0, 50, 10)]
PLAIN = "\n".join(f"{frame} {person} {x:.6f} {y:.6f}" for frame, person, x, y in ROWS)


@pytest.fixture
def read(tmp_path):
    def read(content, columns=None):
        path = tmp_path / "tracks.txt"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return read_recording(path, columns)

    return read


def rows_of(recording):
    people = [recording.labels[i] for i in recording.person]
    return list(zip(recording.frame.tolist(), people, *recording.position.T.round(6).tolist(), strict=True))


EXPECTED = sorted(((float(f), str(p), x, y) for f, p, x, y in ROWS), key=lambda row: (int(row[1]), row[0]))


@settings(max_examples=30)
@given(
    order=st.permutations(range(len(ROWS))),
    separators=st.lists(st.sampled_from([" ", "\t", ", ", ",", ";", "   "]), min_size=len(ROWS), max_size=len(ROWS)),
    number=st.sampled_from(["{:g}", "{:.1f}", "{:.7e}"]),
    end=st.sampled_from(["\n", "\r\n", "\n\n", " \n"]),
)
def test_neither_order_nor_separators_nor_the_way_of_writing_numbers_matter(
    tmp_path_factory, order, separators, number, end
):
    lines = []
    for i in order:
        frame, person, x, y = ROWS[i]
        words = [number.format(frame), number.format(person), f"{x:.6f}", f"{y:.6f}"]
        lines.append(separators[i].join(words))
    path = tmp_path_factory.mktemp("crowd") / "tracks.csv"
    path.write_text(end.join(lines) + end, newline="")
    assert rows_of(read_recording(path)) == EXPECTED


@pytest.mark.parametrize(
    "head",
    [
        "# frame id x y\n% recorded by hand\n\n",
        "# taken in one hall\n",
        "frame,ped_id,x,y\n",
        "frame,trackId,xCenter,yCenter\n",
        '"Frame"\t"PersID"\t"X[m]"\t"Y[m]"\n',
        "\ufeff",
    ],
)
def test_headers_comments_and_marks_of_encodings_are_skipped(read, head):
    assert rows_of(read(head + PLAIN)) == EXPECTED


def test_a_header_names_the_columns_in_any_order_and_says_which_have_no_use(read):
    text = "# PersID\tFrame\tX/m\tY/m\tZ/m\n"
    text += "\n".join(f"{person}\t{frame}\t{x}\t{y}\t1.7" for frame, person, x, y in ROWS)
    found = read(text)
    assert (found.columns, found.num_skipped) == (("id", "frame", "x", "y", "-"), 1)
    assert rows_of(found) == EXPECTED


def test_columns_that_are_said_come_before_all_else(read):
    swapped = "\n".join(f"{person} {frame} {y} {x}" for frame, person, x, y in ROWS)
    assert rows_of(read(f"who,when,lat,lon\n{swapped}", ("id", "frame", "y", "x"))) == EXPECTED


def test_obsmat_has_velocities_and_its_height_is_left_out(read):
    text = "\n".join(f"{f:.7e} {p:.7e} {x:.7e} 0.0 {y:.7e} 0.5 0.0 {-0.1 * p}" for f, p, x, y in ROWS)
    found = read(text)
    assert rows_of(found) == EXPECTED
    assert found.velocity.tolist() == [[0.5, -0.1]] * 5 + [[0.5, pytest.approx(-0.3)]] * 5


def test_of_repeated_rows_the_first_counts(read):
    found = read(f"{PLAIN}\n10 3 99.0 99.0\n10.0 3.0 98.0 98.0")
    assert rows_of(found) == EXPECTED
    assert found.num_repeated == 2


def test_neither_gaps_nor_two_rows_at_nearly_one_time_make_the_usual_step(read):
    times = [0.0, 0.41, 0.8, 0.80001, 1.2, 1.59, 60.0, 60.39, 60.8]
    found = read("\n".join(f"{1.7e9 + time!r} 1 0 {time}" for time in times))
    assert found.usual_step == pytest.approx(0.4, abs=0.02)


def test_ids_may_be_words_and_people_come_in_the_order_of_time(read):
    found = read("20 late 0 0\n10 first 0 0\n10 7 0 0\n20 first 1 0")
    assert found.labels == ("7", "first", "late")
    assert np.diff(found.person).min() >= 0


BAD = {
    "an empty file": ("", "found 'no rows'; allowed: rows of frame id x y (4 columns) or frame id x z y vx vz vy"),
    "comments alone": ("# nothing\n", "found 'no rows'; allowed: rows of frame id x y"),
    "a word in a row": (f"{PLAIN}\n50 3 abc 1.0", "line 11: found 'abc'; allowed: a finite number (x)"),
    "no number": (f"{PLAIN}\n50 3 nan 1.0", "line 11: found 'nan'; allowed: a finite number (x)"),
    "an unknown position": (f"{PLAIN}\n50 3 ? ?", "line 11: found '?'; allowed: a finite number (x)"),
    "an empty cell": ("1,1,,2.0", "line 1: found ''; allowed: a finite number (x)"),
    "a short row": (f"{PLAIN}\n50 3 1.0", "line 11: found '50 3 1.0'; allowed: 4 columns, as in the rows before"),
    "another number of columns": ("1 2 3 4 5 6\n", "line 1: found '6 columns: 1 2 3 4 5 6'; allowed: frame id x y (4"),
    "binary": (b"\x89PNG\r\n\x1a\n\0\0", "line 1: found b'\\x89'; allowed: text in UTF-8 or UTF-16: frame id x y"),
    "zeros": (b"1 2 3 4\n\0\0\0", "line 2: found '\\x00'; allowed: text in UTF-8 or UTF-16: frame id x y"),
    "a header of other names": (
        f"time,who,lat,lon\n{PLAIN}",
        "line 1: found 'time who lat lon'; allowed: a header that names each of frame, id, x, y once, or columns that",
    ),
    "a marked header of other names": (f"# frame id lat lon\n{PLAIN}", "line 1: found 'frame id lat lon'; allowed:"),
    "another format of 8 columns": (
        "\n".join(f"{f},{p},{x},{y},1.7,1.3,0.1,0.2" for f, p, x, y in ROWS),
        "found '8 columns, of which the fourth spans 2.5 and the fifth 0'; allowed: frame id x y (4 columns) or",
    ),
    "a text": ("once upon a time\nthere were people", "found 'no rows'; allowed: rows of frame id x y"),
}


@pytest.mark.parametrize("title", BAD)
def test_what_is_no_recording_is_refused_with_file_and_line(read, tmp_path, title):
    content, message = BAD[title]
    with pytest.raises(InvalidValue) as error:
        read(content)
    assert str(error.value).startswith(f"{tmp_path / 'tracks.txt'}: {message}")
    assert "\n" not in str(error.value)


def test_columns_that_cannot_be_are_refused(read):
    with pytest.raises(InvalidValue, match=r"columns: found 'frame id x x'; allowed: each of frame, id, x, y once"):
        read(PLAIN, ("frame", "id", "x", "x"))
    with pytest.raises(InvalidValue, match=r"line 1: found '4 columns: .*'; allowed: 5 columns: frame id x y -"):
        read(PLAIN, ("frame", "id", "x", "y", "-"))


def test_folders_and_missing_files_are_refused(tmp_path):
    for path in (tmp_path, tmp_path / "none.txt"):
        with pytest.raises(InvalidValue, match="a recording that can be read"):
            read_recording(path)
