"""How a run was made, as a page shows it: scene, controller, what was set, noise, seed and versions."""

from collections.abc import Sequence
from html import escape

from mjnav.report.run_page.shown_run import ShownRun

_DIFFERS = ' class="differs"'
FACTS = (  # of the log's metadata `mjnav/run`
    ("scene", "scene"),
    ("controller", "controller"),
    ("seed", "seed"),
    ("engine", "engine"),
    ("version.mjnav", "mjnav"),
    ("git_revision", "revision"),
    ("version.mujoco", "MuJoCo"),
    ("python", "Python"),
    ("argv", "command"),
)


def parameters(runs: Sequence[ShownRun]) -> str:
    """The section of a page: a column a run, first what differs between them; HTML."""
    columns = [_of_run(run) for run in runs]
    names = list(dict.fromkeys(name for column in columns for name in column))
    texts = {name: [column.get(name, "") for column in columns] for name in names}
    names.sort(key=lambda name: len(set(texts[name])) == 1)  # stable: what differs comes first
    head = "".join(f'<th scope="col">{run.heading}</th>' for run in runs)
    rows = "".join(
        f'<tr{_DIFFERS * (len(set(texts[name])) > 1)}><th scope="row">{escape(name)}</th>'
        f"{''.join(f'<td>{escape(text)}</td>' for text in texts[name])}</tr>"
        for name in names
    )
    top = f"<thead><tr><td></td>{head}</tr></thead>" if len(runs) > 1 else ""
    return f'<div class="wide"><table class="parameters">{top}<tbody>{rows}</tbody></table></div>'


def _of_run(run: ShownRun) -> dict[str, str]:
    """Names and values: scene, controller and what was set first, then noise, seed and versions."""
    info = run.inspection.run or {}
    known = {label: str(info[key]) for key, label in FACTS if info.get(key)}
    first = {label: known.pop(label) for label in ("scene", "controller") if label in known}
    return {**first, **run.playback.parameters, "noise": run.playback.noise, **known}
