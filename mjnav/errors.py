"""What mjnav raises, and the exit code that the command line gives for it."""

import shlex
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from difflib import get_close_matches
from functools import partial
from traceback import extract_tb

_MAX_SHOWN = 120  # characters of a key and of a found value in a message
_MAX_TEXT = 300  # of an exception's message


class MjnavError(Exception):
    """Root of all errors that mjnav raises on purpose."""

    exit_code = 1


class InputError(MjnavError):
    """The user's input cannot be used; raised before anything starts."""

    exit_code = 2


class DamagedLogError(MjnavError):
    """A log fails its checksum or holds nothing readable."""

    exit_code = 3


class UntrustedCode(InputError):
    """A log names code that is not mjnav's own; `what` it is, how to trust it, and what runs another in its place."""

    def __init__(self, what: str, *, trust: str = "trust=True", other: str | None = "controller=NAME"):
        self.what, self.other = what, other
        instead = f", {other} runs another in its place" if other else ""
        super().__init__(f"{what}, code that a replay imports and runs: {trust} allows it{instead}")


@contextmanager
def own_code(fault: Callable[[BaseException], Exception], *passed: type[Exception]) -> Iterator[None]:
    """Runs code of the user's own: whatever it raises, SystemExit and GeneratorExit too, becomes `fault(error)`.

    An interrupt stays one, and so do the errors that `passed` names and those that end a run.
    """
    try:
        yield
    except BaseException as error:
        ends = isinstance(error, MjnavError) and not isinstance(error, InputError)
        if ends or isinstance(error, (KeyboardInterrupt, *passed)):
            raise
        raise fault(error) from error


def message(error: BaseException) -> str:
    """The message of an exception in a line, also of one that has no text to give."""
    text = _text(str, error)
    return "its __str__ raises" if text is None else _cut(" ".join(text.split()), _MAX_TEXT)


def said(error: BaseException) -> str:
    """The type of an exception and its message in a line."""
    return ": ".join(part for part in (type(error).__name__, message(error)) if part)


class PluginFault(MjnavError):
    """What a plug-in returned in a run cannot be used, or what it raised; it ends the run."""

    @classmethod
    @contextmanager
    def told(cls, name: str, call: str) -> Iterator[None]:
        """What `call` of the plug-in `name` raises becomes this, with its place: also before the first tick."""

        def fault(error: BaseException) -> PluginFault:
            frame = extract_tb(error.__traceback__)[-1]
            return cls(f"{name}: {call} raised {said(error)} ({frame.filename}:{frame.lineno})")

        with own_code(fault):
            yield


class InvalidValue(InputError, ValueError):
    """One value that is not allowed: where it stands, what was found, what is allowed.

    ``key`` is a dotted path ("people.0.radius"); ``file`` is added where the file was read; ``found`` is None where a
    required value is missing.
    """

    def __init__(self, key: str, found: object, allowed: str, *, file: str | None = None, nearest: str | None = None):
        self.key, self.found, self.allowed, self.file, self.nearest = key, found, allowed, file, nearest
        parts = [
            f"{file}: " if file else "",
            f"{_cut(_one_line(key))}: " if key else "",
            f"found {_shown(found)}; allowed: {allowed}",
        ]
        if nearest is not None:
            parts.append(f"; did you mean {nearest!r}?")
        super().__init__("".join(parts))

    def __reduce__(self):
        # An exception is pickled as its message alone, which does not make it again; workers send theirs back.
        return partial(InvalidValue, file=self.file, nearest=self.nearest), (self.key, self.found, self.allowed)

    def within(self, prefix: str = "", *, file: str | None = None) -> "InvalidValue":
        """The same error seen from outside: its key below `prefix`, in `file`."""
        key = ".".join(part for part in (prefix, self.key) if part)
        return InvalidValue(key, self.found, self.allowed, file=file or self.file, nearest=self.nearest)


def _shown(found: object) -> str:
    if found is None:
        return "nothing"
    text = _text(repr, found)  # none of an integer of more digits than Python prints
    if text is None:
        return f"a {type(found).__name__}"
    return _cut(" ".join(line.strip() for line in text.split("\n")))  # an array has many


def _one_line(key: str) -> str:
    """A key as it is written in its file, with escapes for characters that would end or change the line."""
    return key if key.isprintable() else repr(key)[1:-1]


def _cut(text: str, most: int = _MAX_SHOWN) -> str:
    return text if len(text) <= most else f"{text[:most]}..."


def _text(form: Callable[[object], str], thing: object) -> str | None:
    """`str` or `repr` of a thing; None where its own method raises."""
    try:
        return form(thing)
    except KeyboardInterrupt:
        raise
    except BaseException:
        return None


def unknown_name(key: str, found: str, names: Iterable[str], *, what: str = "", also: str = "") -> InvalidValue:
    """The error for a name that does not exist, with the names that do, `what` they are, and the nearest of them.

    `also` says what may stand in place of a name.
    """
    names = sorted(names)
    lower = {name.lower(): name for name in names}
    nearest = [lower[name] for name in get_close_matches(str(found).lower(), lower, n=1, cutoff=0.5)]
    allowed = f"{what}: {', '.join(names)}" if what else ", ".join(names)
    allowed += f"; or {also}" if also else ""
    return InvalidValue(key, found, allowed, nearest=nearest[0] if nearest else None)


def missing_extra(package: str, extra: str) -> InputError:
    """The error for an optional package that is not installed, with the command that installs what the extra brings.

    The command names the extra's own requirements, so that it works wherever mjnav itself came from.
    """
    from importlib.metadata import PackageNotFoundError, distribution

    wanted, by_uv = [package], False
    with suppress(PackageNotFoundError):  # run from a folder of sources alone
        found = distribution("mjnav")
        split = [requirement.replace('"', "'").split("; ") for requirement in found.requires or ()]
        wanted = [words[0] for words in split if words[1:] == [f"extra == '{extra}'"]] or wanted
        by_uv = (found.read_text("INSTALLER") or "").strip() == "uv"
    install = ["uv", "pip", "install", "--python"] if by_uv else []
    install += [sys.executable] if by_uv else [sys.executable, "-m", "pip", "install"]
    return InputError(f"{package} is not installed: {shlex.join([*install, *wanted])}")


@contextmanager
def of_extra(package: str, extra: str) -> Iterator[None]:
    """Within it an optional package is imported: where that fails, it raises `missing_extra`."""
    try:
        yield
    except ImportError:
        raise missing_extra(package, extra) from None
