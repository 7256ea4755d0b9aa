"""`mjnav COMMAND ...`: finds the command's module, and turns what it raises into an exit code and a line of text."""

import argparse
import os
import re
import shlex
import sys
from collections.abc import Collection, Mapping, Sequence
from contextlib import nullcontext
from difflib import get_close_matches
from importlib import import_module
from types import MappingProxyType
from typing import Any

from mjnav.cli.terminal import Guard, guarded, plain_output, quiet_output, readable_output, tell
from mjnav.errors import InputError, InvalidValue, MjnavError, UntrustedCode, unknown_name
from mjnav.printable import printable

INTERRUPTED = 130
NUMBA_FILE = ".numba_config.yaml"  # numba reads its settings from there at every compilation

# heading -> command -> (module, what it does); a module is imported when its command is called
_GROUPS: Mapping[str, Mapping[str, tuple[str, str]]] = MappingProxyType(
    {
        "run": {
            "run": ("mjnav.cli.run", "run one episode of a scene"),
            "list": ("mjnav.cli.list", "list the names of scenes, controllers and all else that run files may name"),
            "show": ("mjnav.cli.show", "print a shipped run file or study file"),
            "keys": ("mjnav.cli.keys", "list keys of run files and study files: type, range, default, meaning"),
        },
        "look at a run": {
            "inspect": ("mjnav.cli.inspect", "print what a log holds and how its run went"),
            "report": ("mjnav.cli.report", "write a page that shows what happened in a run"),
            "render": ("mjnav.cli.render", "draw one moment of a run, or film it"),
            "replay": ("mjnav.cli.replay", "run a log's scenario again and compare it tick by tick"),
            "export": ("mjnav.cli.export", "write a log as tables or a ROS 2 bag"),
            "recover": ("mjnav.cli.recover", "write what is intact in a damaged log to a new one"),
            "surface": ("mjnav.cli.surface", "draw the cost of one decision over all speeds and turn rates"),
        },
        "study": {
            "sweep": ("mjnav.cli.sweep", "run a study: scenes, methods and settings under many seeds"),
            "compare": ("mjnav.cli.compare", "compare a study's methods: tables with intervals and differences"),
            "bench": ("mjnav.cli.bench", "put methods beside all shipped ones, in suites that nobody tunes on"),
            "avoidable": ("mjnav.cli.avoidable", "say which collisions and time-outs of runs could have been avoided"),
            "predict": ("mjnav.cli.predict", "compare predictions of people with where they went"),
            "paper": ("mjnav.cli.paper", "reproduce the figures of Nair et al. and judge its claims"),
        },
        "advanced": {
            "rate-test": ("mjnav.cli.rate_test", "test whether the loop keeps its rate on this machine"),
            "import": (
                "mjnav.cli.import_file",
                "say what recorded people, a map or a world holds, and make a scene of it",
            ),
            "noise": ("mjnav.cli.noise", "fit laws to recorded errors, as tables of a run file"),
            "robot": ("mjnav.cli.robot", "check that a robot does in MuJoCo what it is commanded"),
            "map": ("mjnav.cli.map", "write the floor of a scene as a map of ROS map_server"),
            "schema": ("mjnav.cli.schema", "print the JSON Schema of run files or study files, for editors"),
            "completion": ("mjnav.cli.completion", "print a script that completes command lines of mjnav in a shell"),
        },
    }
)
COMMANDS: Mapping[str, tuple[str, str]] = MappingProxyType(
    {name: entry for group in _GROUPS.values() for name, entry in group.items()}
)


class _Parser(argparse.ArgumentParser):
    def __init__(self, **options: Any):
        super().__init__(**options)
        self._negative_number_matcher = re.compile(r"-\.?\d")  # "-2.25,3" is a point, no option

    def error(self, message: str):
        raise InputError(f"{message}; {_shows_options(self.prog)}")


class _MainParser(_Parser):
    def format_help(self) -> str:
        """The commands under their headings, a line each."""
        lines = [f"usage: {self.prog} COMMAND ...", "", str(self.description)]
        for heading, commands in _GROUPS.items():
            lines += ["", f"{heading}:", *(f"  {name:<12}{text}" for name, (_, text) in commands.items())]
        more = f"`{self.prog} help COMMAND` shows the options of a command, `{self.prog} --version` the version."
        return "\n".join([*lines, "", more, ""])


def start() -> int:
    """The entry point: runs the command in a child process and reports how that ends."""
    readable_output()
    return guarded(lambda guard: main(guard=guard))


def main(argv: Sequence[str] | None = None, *, guard: Guard | None = None) -> int:
    """Runs one command in this process; returns its exit code."""
    argv = sys.argv[1:] if argv is None else list(argv)
    os.environ["PYTHONSAFEPATH"] = "1"  # libraries start interpreters too: none takes modules from the working folder
    with plain_output():
        return _exit_code(argv, guard or Guard())


def _exit_code(argv: list[str], guard: Guard) -> int:
    """Runs a command; what it raises becomes one line and an exit code."""
    try:
        _check_working_folder()
        code = _execute(argv, guard)
        if sys.stdout is not None:
            sys.stdout.flush()  # here, where an error can still be reported
        return code
    except KeyboardInterrupt:
        tell("interrupted")
        return INTERRUPTED
    except BrokenPipeError:  # the reader of our output has gone
        _drop_output()
        return 0
    except MjnavError as error:
        if "--traceback" in argv:  # also where the words cannot be parsed
            import traceback

            traceback.print_exc()
        tell(str(error))
        return error.exit_code
    except OSError as error:  # run files and logs raise errors of their own: what is left is standard output's
        _drop_output()
        tell(str(error))
        return MjnavError.exit_code


def _check_working_folder() -> None:
    """Raises InputError where a file in the working folder would change how kernels are compiled."""
    if os.path.lexists(NUMBA_FILE):
        raise InputError(
            f"{NUMBA_FILE} in the working folder would change how mjnav compiles: remove it or call mjnav in another "
            "folder; settings of your own are environment variables (NUMBA_OPT, NUMBA_CACHE_DIR)"
        )


def _drop_output() -> None:
    """Discards buffered standard output, which the interpreter would try to write again at its exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def command_parser(
    configured: Collection[str],
) -> tuple[argparse.ArgumentParser, Mapping[str, argparse.ArgumentParser]]:
    """The parser of mjnav, and that of each command: only `configured` ones get their options, which takes imports."""
    parser = _MainParser(prog="mjnav", description="Robot navigation under non-Gaussian uncertainty, in MuJoCo.")
    parser.add_argument("--version", action="store_true", help="print the version and end")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", parser_class=_Parser)
    for command, (path, text) in COMMANDS.items():
        sub = commands.add_parser(command, help=text, description=f"{text[0].upper()}{text[1:]}.")
        if command in configured:
            import_module(path).configure(sub)
            _everywhere(sub, command)
    return parser, commands.choices


def _execute(argv: list[str], guard: Guard) -> int:
    if argv[:1] == ["help"]:
        argv = [*argv[1:], "--help"]
    name = next((word for word in argv if not word.startswith("-")), None)
    if name is not None and name not in COMMANDS:
        raise unknown_name("command", name, COMMANDS)
    parser, commands = command_parser((name,) if name is not None else ())
    given = argparse.Namespace(guard=guard, command_line=printable(shlex.join(["mjnav", *argv])))
    arguments, unknown = parser.parse_known_args(argv, given)
    if unknown:
        raise _unknown_words(commands.get(name or "", parser), unknown)
    if arguments.version:
        from importlib.metadata import version

        print(version("mjnav"))
        return 0
    if arguments.command is None:
        parser.print_help()
        return 0
    with quiet_output() if getattr(arguments, "quiet", False) else nullcontext():
        try:
            return import_module(COMMANDS[arguments.command][0]).execute(arguments)
        except MjnavError as error:
            raise _in_options(error, commands[arguments.command]) from error.__cause__
        except (Exception, KeyboardInterrupt):
            raise
        except BaseException as error:  # SystemExit that nothing else caught is no end of ours
            from mjnav.loop.supervision import describe_fault

            raise MjnavError(f"the command was ended from within: {describe_fault(error)}") from error


# ------------------------------------------- errors in the words of options, options of every command


_WITH = " with "  # between a file and the arguments that changed it


def _in_options(error: MjnavError, parser: argparse.ArgumentParser) -> MjnavError:
    """The error with a command's options in place of arguments."""
    if isinstance(error, UntrustedCode):
        other = "--controller NAME" if error.other == "controller=NAME" else None
        return UntrustedCode(error.what, trust="--trust", other=other)
    if not isinstance(error, InvalidValue):
        return error
    options = {action.dest: action.option_strings[-1] for action in parser._actions if action.option_strings}
    if error.file is None:
        key = options.get(error.key, error.key)
        return InvalidValue(key, error.found, error.allowed, nearest=error.nearest)
    head, between, tail = error.file.rpartition(_WITH)
    words = tail.split(", ")
    if not all(word in options for word in words) or (head and not between):
        return error
    return error.within(file=f"{head}{between}{', '.join(options[word] for word in words)}")


def _shows_options(command: str) -> str:
    """Where the options of a command are shown."""
    return f"`{command} --help` shows what it takes"


def _unknown_words(parser: argparse.ArgumentParser, words: Sequence[str]) -> InputError:
    """The error for words that a command does not take, with what the first option among them may have meant."""
    option = next((word.partition("=")[0] for word in words if word.startswith("-")), None)
    if option is None:
        return InputError(f"{parser.prog} does not take {' '.join(words)!r}; {_shows_options(parser.prog)}")
    nearest = get_close_matches(option.lower(), parser._option_string_actions, n=1) if len(option) > 2 else []
    instead = f"did you mean {nearest[0]}?" if nearest else _shows_options(parser.prog)
    return InputError(f"{parser.prog} has no option {option}; {instead}")


SAYING = ("list", "show", "keys", "schema", "completion")  # commands that only print: there is nothing to leave out


def _everywhere(parser: argparse.ArgumentParser, command: str) -> None:
    """-q, where the command does more than print, and --traceback."""
    group = parser.add_argument_group("everywhere")
    if command not in SAYING:
        group.add_argument(
            "-q", "--quiet", action="store_true", help="print neither results nor progress; the exit code says"
        )
    group.add_argument("--traceback", action="store_true", help="where a fault came from, for code of your own")


if __name__ == "__main__":
    sys.exit(start())
