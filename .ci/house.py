"""The size of the house: files, code lines and imports of every room, against its budget.

    python .ci/house.py            # the table; exits with 1 where a room is above its budget
    uv run python .ci/house.py --path [SCENE]    # files and changes of room of one `Simulation()` and of one tick

Code lines are lines with code on them: no blank ones, comments or docstrings. Adding to a room that is full means
removing something there first; a budget is raised only together with what it is raised for.
"""

import ast
import io
import sys
import tokenize
from itertools import pairwise
from pathlib import Path
from types import FrameType

HOUSE = Path(__file__).parents[1] / "mjnav"
BUDGETS = {  # code lines
    ".": 612,
    "cli": 2519,
    "compile": 344,
    "constraints": 381,
    "control": 3322,
    "filters": 292,
    "geometry": 1086,
    "gym": 332,
    "log": 3166,
    "loop": 2357,
    "metrics": 1940,
    "motion": 515,
    "noise": 829,
    "paper": 1093,
    "report": 2592,
    "rkhs": 103,
    "robot": 4074,
    "scene": 3676,
    "settings": 823,
    "study": 3241,
    "world": 2730,
}
MOST_FILES = 309
MOST_IMPORTS = 0.0995  # of all code lines
SILENT = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}
SCOPES = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


def code_lines(source: str) -> tuple[int, int]:
    """How many lines of code a source has, and how many of them import."""
    tree = list(ast.walk(ast.parse(source)))
    first = [scope.body[0] for scope in tree if isinstance(scope, SCOPES) and ast.get_docstring(scope, clean=False)]
    docstrings = {line for text in first for line in range(text.lineno, (text.end_lineno or 0) + 1)}
    tokens = tokenize.generate_tokens(io.StringIO(source).readline)
    code = {n for t in tokens if t.type not in SILENT for n in range(t.start[0], t.end[0] + 1)} - docstrings
    imports = [node for node in tree if isinstance(node, ast.Import | ast.ImportFrom)]
    return len(code), len(code & {n for node in imports for n in range(node.lineno, (node.end_lineno or 0) + 1)})


def room_of(path: str | Path) -> str:
    """The folder of mjnav that a file lies in; "." for mjnav itself."""
    parts = Path(path).relative_to(HOUSE).parts
    return parts[0] if len(parts) > 1 else "."


def check() -> int:
    """Prints the table; 1 where a budget is exceeded."""
    rooms: dict[str, list[int]] = {}
    for path in sorted(HOUSE.rglob("*.py")):
        counts = rooms.setdefault(room_of(path), [0, 0, 0])
        for i, count in enumerate((1, *code_lines(path.read_text(encoding="utf-8")))):
            counts[i] += count
    over = []
    print(f"{'room':14} files   lines  budget  imports")
    for room, (files, lines, imports) in sorted(rooms.items()):
        budget = BUDGETS.get(room, 0)
        print(f"{room:14} {files:5} {lines:7} {budget:7} {imports / max(lines, 1):8.1%}")
        over += [f"{room} has {lines} lines; its budget is {budget}"] if lines > budget else []
    files, lines, imports = (sum(counts[i] for counts in rooms.values()) for i in range(3))
    print(f"{'all':14} {files:5} {lines:7} {sum(BUDGETS.values()):7} {imports / lines:8.1%}")
    over += [f"{files} files; at most {MOST_FILES}"] if files > MOST_FILES else []
    over += [f"imports are {imports / lines:.2%} of the code; at most {MOST_IMPORTS:.2%}"] * (
        imports > MOST_IMPORTS * lines
    )
    print(*over, sep="\n", end="\n" if over else "")
    return 1 if over else 0


class Visits:
    """The files that calls went through, in order."""

    def __init__(self) -> None:
        self.files: list[str] = []

    def __call__(self, frame: FrameType, event: str, argument: object) -> None:
        """Notes the file of a call; a profile function of `sys.setprofile`."""
        file = frame.f_code.co_filename
        if event == "call" and file.startswith(str(HOUSE)) and (not self.files or self.files[-1] != file):
            self.files.append(file)

    def told(self) -> str:
        """Files, and how often the next file was in another room."""
        rooms = [room_of(file) for file in self.files]
        changes = sum(a != b for a, b in pairwise(rooms))
        return f"{len(set(self.files))} files, {changes} changes of room"


def trace(scene: str) -> int:
    """Prints the paths of making a simulation and of its third tick, in the thread that makes them."""
    import mjnav

    mjnav.run(mjnav.load_scenario(scene, {"time_limit": 1.0}), log=None)  # all modules are imported, all kernels there
    making, tick = Visits(), Visits()
    sys.setprofile(making)
    simulation = mjnav.Simulation(scene)
    sys.setprofile(None)
    for _ in range(2):
        simulation.step(simulation.decide())
    sys.setprofile(tick)
    simulation.step(simulation.decide())
    sys.setprofile(None)
    print(f"Simulation({scene!r}): {making.told()}\none tick: {tick.told()}")
    return 0


if __name__ == "__main__":
    words = sys.argv[1:]
    sys.exit(trace(words[1] if words[1:] else "hall") if words[:1] == ["--path"] else check())
