"""Which logs are meant by a file, a folder of logs, or a study: those that its sweep kept."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from mjnav.errors import InputError, InvalidValue
from mjnav.study.results import find_results
from mjnav.study.store.logs import kept_log
from mjnav.study.store.store import Store

DEFAULT_SETTING = "default"
_COLUMNS = ("scene", "setting", "method", "seed", "success", "error", "log")


@dataclass(frozen=True, slots=True)
class Source:
    """A log, and the name that its study gives the method; None of a log without a study."""

    path: Path
    method: str | None = None


@dataclass(frozen=True, slots=True)
class Kept:
    """How many logs a study kept."""

    folder: Path
    episodes: int
    failures: int  # episodes with a result that did not succeed
    logs: int
    failures_without_log: int

    def __str__(self) -> str:
        text = f"{self.folder}: logs of {self.logs} of {self.episodes} episodes"
        if self.failures_without_log:
            lacking = f"{self.failures_without_log} of {self.failures} failures have none"
            return f"{text}; {lacking}: mjnav sweep --keep-logs failures keeps them"
        if self.logs == self.episodes:
            return text
        return f"{text}, every failure among them: shares are the study's, times at rest those of these runs alone"


def sources(given: str) -> tuple[Sequence[Source], Kept | None]:
    """The logs that `given` names, and of a study how many it kept.

    A file is a log; a folder with logs stands for these; anything else is a study as `mjnav compare` takes it. Raises
    InputError where there is no log.
    """
    path = Path(given)
    if path.suffix == ".mcap" or (path.is_file() and path.suffix != ".toml"):
        return (Source(path),), None
    if path.is_dir() and (logs := sorted(path.glob("*.mcap"))):
        return tuple(map(Source, logs)), None
    if path.is_dir() and not any(path.glob("*.parquet")):
        raise InputError(f"{path}: a folder without logs (*.mcap) and without results of a sweep")
    try:
        return _of_study(find_results(given)[0])
    except InvalidValue as error:
        if error.key != "study":
            raise
        raise InvalidValue(
            "LOG", given, f"a log, a folder of logs, or {error.allowed}", nearest=error.nearest
        ) from None


def _of_study(store: Store) -> tuple[Sequence[Source], Kept]:
    found, failures, lacking = [], 0, 0
    rows = store.rows(_COLUMNS).to_pylist()
    for row in sorted(rows, key=lambda row: [row[name] for name in ("method", "setting", "scene", "seed")]):
        log = kept_log(store.folder, row["log"])
        failed = row["error"] is None and not row["success"]
        failures += failed
        lacking += failed and log is None
        if log is not None:
            setting = "" if row["setting"] == DEFAULT_SETTING else f", {row['setting']}"
            found.append(Source(log, f"{row['method']}{setting}"))
    if not found:
        raise InputError(
            f"{store.folder}: kept no logs; mjnav sweep STUDY --keep-logs failures keeps those of episodes that fail"
        )
    return tuple(found), Kept(store.folder, len(rows), failures, len(found), lacking)
