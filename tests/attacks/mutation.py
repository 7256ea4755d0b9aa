"""Mutation score: which changes of the mathematics do their own tests notice? `uv run python tests/attacks/mutation.py`

    mutation.py [--every N] [FOLDER | FOLDER/MODULE ...]      by default all of FOLDERS

With `--every N` one mutant in N, always the same ones: those whose key's checksum N divides.

Every operator, comparison, number and `min` or `max` of a module is changed, one at a time, and the module's own tests
run until one fails, first with few examples of hypothesis, then with all. Kernels run as plain Python meanwhile
(NUMBA_DISABLE_JIT=1), so that a change acts without being compiled; each mutant is a fork of one process that has all
libraries loaded. Mutants that no test can notice are listed with the reason in equivalent_mutants.toml. Prints every
other survivor and a table; exits 1 where there are survivors.

mutmut leaves decorated functions out, which all kernels are, and cosmic-ray starts an interpreter for every mutant.
"""

import ast
import gc
import importlib.abc
import importlib.util
import os
import resource
import sys
import tomllib
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.machinery import SourceFileLoader
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, settings

ROOT = Path(__file__).parents[2]
EQUIVALENT = Path(__file__).with_name("equivalent_mutants.toml")
FOLDERS = ("rkhs", "constraints", "filters", "control/problem", "metrics")
# Tests that prove a folder or a module beside those that are named after it.
ALSO = {
    "control/problem": ("control/methods/test_*.py",),
    "metrics/timing": ("metrics/test_schedule.py", "metrics/test_blame.py"),
}
FEW, MANY = 10, 100  # examples of hypothesis a test
PATIENCE = 5.0  # times the processor time that the tests need, after which a mutant hangs

SWAPS: dict[type, tuple[type, ...]] = {
    ast.Add: (ast.Sub,),
    ast.Sub: (ast.Add,),
    ast.Mult: (ast.Div,),
    ast.Div: (ast.Mult,),
    ast.FloorDiv: (ast.Div,),
    ast.Mod: (ast.Mult,),
    ast.Pow: (ast.Mult,),
    ast.BitAnd: (ast.BitOr,),
    ast.BitOr: (ast.BitAnd,),
    ast.And: (ast.Or,),
    ast.Or: (ast.And,),
    ast.USub: (ast.UAdd,),
    ast.Lt: (ast.LtE, ast.GtE),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.LtE),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
}
_PAIRS = (("min", "max"), ("minimum", "maximum"), ("argmin", "argmax"), ("any", "all"), ("sin", "cos"))
NAMES = {a: b for pair in _PAIRS for a, b in (pair, pair[::-1])}


@dataclass(frozen=True)
class Mutant:
    """One change of one module."""

    module: str  # dotted
    path: Path
    line: int
    text: str  # the line as it stands
    change: str  # of the expression around it; "#2" where the line holds the same one a second time
    tree: ast.Module

    @property
    def key(self) -> tuple[str, str, str]:
        """What it is known by, wherever the line moves."""
        return self.module, self.text, self.change

    def sampled(self, every: int) -> bool:
        """Whether it is of the one in `every` that are tried."""
        return zlib.crc32(repr(self.key).encode()) % every == 0


def changes(node: ast.AST) -> Iterator[Callable[[ast.AST], None]]:
    """What can be done to a node of the syntax tree, as functions of that node in a copy of the tree."""
    match node:
        case ast.BinOp(op=op) | ast.AugAssign(op=op) | ast.BoolOp(op=op) | ast.UnaryOp(op=op):
            for other in SWAPS.get(type(op), ()):
                yield lambda copy, other=other: setattr(copy, "op", other())
            if isinstance(op, ast.Not):
                yield lambda copy: setattr(copy, "operand", ast.UnaryOp(ast.Not(), copy.operand))  # type: ignore
        case ast.Compare(ops=ops):
            for i, op in enumerate(ops):
                for other in SWAPS.get(type(op), ()):
                    yield lambda copy, i=i, other=other: copy.ops.__setitem__(i, other())  # type: ignore
        case ast.Constant(value=bool() as value):
            yield lambda copy: setattr(copy, "value", not value)
        case ast.Constant(value=int() | float() as value):
            yield lambda copy: setattr(copy, "value", value + 1)
        case ast.Name(id=name) if name in NAMES:
            yield lambda copy: setattr(copy, "id", NAMES[name])
        case ast.Attribute(attr=name) if name in NAMES:
            yield lambda copy: setattr(copy, "attr", NAMES[name])
        case ast.Raise():
            yield lambda copy: setattr(copy, "__class__", ast.Pass)
        case ast.Break() | ast.Continue():
            other = ast.Continue if isinstance(node, ast.Break) else ast.Break
            yield lambda copy: setattr(copy, "__class__", other)


def left_out(tree: ast.Module) -> set[ast.AST]:
    """Nodes that say nothing of what is computed: types, decorators, and what an error says."""
    found: set[ast.AST] = set()
    for node in ast.walk(tree):
        parts: list[ast.AST | None] = []
        if isinstance(node, ast.FunctionDef):
            parts = [node.returns, *node.decorator_list]
        elif isinstance(node, ast.ClassDef):
            parts = [*node.decorator_list]
        elif isinstance(node, ast.arg | ast.AnnAssign):
            parts = [node.annotation]
        elif isinstance(node, ast.Raise):
            parts = [node.exc]
        for part in parts:
            found.update(ast.walk(part) if part else ())
    return found


def module_name(path: Path) -> str:
    """The dotted name of a file."""
    return ".".join(path.relative_to(ROOT).with_suffix("").parts)


def mutants(path: Path) -> Iterator[Mutant]:
    """Of one module, in the order of its lines."""
    source = path.read_text()
    lines = source.splitlines()
    tree = ast.parse(source)
    skipped = left_out(tree)
    seen: dict[tuple[int, str], int] = {}
    nodes = [(i, node) for i, node in enumerate(ast.walk(tree)) if node not in skipped and hasattr(node, "lineno")]
    for i, node in sorted(nodes, key=lambda item: (item[1].lineno, item[1].col_offset)):
        for change in changes(node):
            changed = ast.parse(source)
            copy = next(other for j, other in enumerate(ast.walk(changed)) if j == i)
            before = ast.unparse(copy)
            change(copy)
            ast.fix_missing_locations(changed)
            told = f"{before} -> {ast.unparse(copy)}" if not isinstance(node, ast.Raise) else "raise -> pass"
            number = seen[node.lineno, told] = seen.get((node.lineno, told), 0) + 1
            told += f" #{number}" if number > 1 else ""
            yield Mutant(module_name(path), path, node.lineno, lines[node.lineno - 1].strip(), told, changed)


class MutantFinder(importlib.abc.MetaPathFinder):
    """Imports one module as its mutant."""

    def __init__(self, mutant: Mutant):
        self.mutant = mutant

    def find_spec(self, fullname, path=None, target=None):
        if fullname != self.mutant.module:
            return None
        code = compile(self.mutant.tree, str(self.mutant.path), "exec", dont_inherit=True)

        class Loader(SourceFileLoader):
            def get_code(self, fullname):
                return code

        place = str(self.mutant.path)
        return importlib.util.spec_from_file_location(fullname, place, loader=Loader(fullname, place))


class FewerExamples:
    """A plugin of pytest: hypothesis tries few examples, always the same, and makes none smaller."""

    def __init__(self, num: int):
        self.num = num

    def pytest_configure(self):
        phases = (Phase.explicit, Phase.generate)
        few = {"max_examples": self.num, "phases": phases, "deadline": None, "derandomize": True, "database": None}
        settings.register_profile("mutation", **few, suppress_health_check=list(HealthCheck))
        settings.load_profile("mutation")


def tests_of(path: Path) -> list[str]:
    """The test files named after a module, else all of its folder; then those in `ALSO`."""
    own = path.parent.relative_to(ROOT / "mjnav")
    folder = ROOT / "tests" / own
    found = sorted(folder.glob(f"test_{path.stem}*.py")) or sorted(folder.glob("test_*.py"))
    for key in (str(own), str(own / path.stem)):
        found += [file for names in ALSO.get(key, ()) for file in sorted((ROOT / "tests").glob(names))]
    return [str(file) for file in found]


def run_tests(tests: list[str], examples: int, *options: str) -> int:
    """pytest's exit code."""
    words = ["-x", "-q", "-p", "no:cacheprovider", "-W", "ignore::pytest.PytestAssertRewriteWarning", *options, *tests]
    return int(pytest.main(words, plugins=[FewerExamples(examples)]))


def forked(work: Callable[[], int], limit: float) -> tuple[int, float]:
    """Exit code of `work` in a child that may use `limit` [s] of processor time, < 0 for a signal; and what it used."""
    child = os.fork()
    if child == 0:
        code = 1
        try:
            nowhere = os.open(os.devnull, os.O_RDWR)
            for stream in (0, 1, 2):
                os.dup2(nowhere, stream)
            resource.setrlimit(resource.RLIMIT_CPU, (max(1, round(limit)), max(2, round(limit) + 1)))
            code = work()
        finally:
            os._exit(code)
    _, status, used = os.wait4(child, 0)
    return os.waitstatus_to_exitcode(status), used.ru_utime + used.ru_stime


def preload(tests: list[str]) -> None:
    """Loads what the tests import beside mjnav itself, once for every fork."""
    standard = os.dup(1)
    with open(os.devnull, "w") as nowhere:
        os.dup2(nowhere.fileno(), 1)
        run_tests(tests, FEW, "--collect-only")
        sys.stdout.flush()
        os.dup2(standard, 1)
    for name in [name for name in sys.modules if name.split(".")[0] in ("mjnav", "tests", "conftest")]:
        del sys.modules[name]
    gc.collect()
    gc.freeze()


def survives(mutant: Mutant, tests: list[str], limit: float) -> bool:
    """Whether no test notices."""

    def work(examples: int) -> int:
        sys.meta_path.insert(0, MutantFinder(mutant))
        return run_tests(tests, examples)

    return all(forked(lambda n=examples: work(n), limit)[0] == 0 for examples in (FEW, MANY))


def examine(path: Path, explained: set[tuple[str, str, str]], every: int) -> tuple[int, int, int]:
    """Mutants, survivors that are explained and survivors that are not, which are printed."""
    tests = tests_of(path)
    code, used = forked(lambda: run_tests(tests, MANY), 3600.0)
    if code != 0:
        sys.exit(f"{path}: its tests fail without a mutant")
    total = equivalent = 0
    alive, there = [], set()
    for mutant in mutants(path):
        there.add(mutant.key)
        if not mutant.sampled(every):
            continue
        total += 1
        if mutant.key in explained:
            equivalent += 1
        elif survives(mutant, tests, PATIENCE * used + 5.0):
            alive.append(mutant)
            print(f"  {path.relative_to(ROOT)}:{mutant.line}: {mutant.text}\n      {mutant.change}", flush=True)
    for _, line, change in sorted(key for key in explained - there if key[0] == module_name(path)):
        print(f"  {path.relative_to(ROOT)}: {EQUIVALENT.name} names a mutant that is not there: {line}\n      {change}")
    return total, equivalent, len(alive)


def main(words: list[str]) -> int:
    os.environ["NUMBA_DISABLE_JIT"] = "1"
    os.chdir(ROOT)
    every = 1
    if words[:1] == ["--every"]:
        every, words = int(words[1]), words[2:]
    paths = []
    for word in words or FOLDERS:
        place = ROOT / "mjnav" / word
        paths += sorted(place.glob("[!_]*.py")) if place.is_dir() else [place.with_suffix(".py")]
    listed = tomllib.loads(EQUIVALENT.read_text())["mutant"]
    explained = {(m["module"], m["line"], change) for m in listed for change in m["changes"]}
    preload([test for path in paths for test in tests_of(path)])
    rows: dict[str, list[int]] = {}
    for path in paths:
        row = rows.setdefault(str(path.parent.relative_to(ROOT / "mjnav")), [0, 0, 0])
        found = examine(path, explained, every)
        row[:] = [a + b for a, b in zip(row, found, strict=True)]
        print(f"{path.relative_to(ROOT)}: {found[0]} mutants, {found[1]} equivalent, {found[2]} survived", flush=True)
    print(f"{'folder':15} {'mutants':>8} {'killed':>8} {'equivalent':>11} {'survived':>9} {'score':>7}")
    for name, (total, equivalent, alive) in {**rows, "all": [sum(c) for c in zip(*rows.values(), strict=True)]}.items():
        killed = total - equivalent - alive
        score = 100.0 * killed / max(total - equivalent, 1)
        print(f"{name:15} {total:8} {killed:8} {equivalent:11} {alive:9} {score:6.1f}%")
    return int(any(row[2] for row in rows.values()))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
