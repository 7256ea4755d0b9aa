"""`mjnav surface SCENE --at TIME`: what one decision's cost is over all (v, omega), as a picture and as arrays."""

import argparse
from typing import Any

import numpy as np

from mjnav.cli import options
from mjnav.cli.terminal import answer, compile_notice, progress
from mjnav.control.decision_surface import DecisionSurface, decision_surface, require_candidates
from mjnav.control.parameters import WINDOWS
from mjnav.loop.prepare import OUT_FOLDER, file_stem, load_scenario, make_out_folder
from mjnav.loop.run import column_names, record_at, warm_up
from mjnav.messages import Status
from mjnav.output_files import output_path, written
from mjnav.robot.controller import build_controller
from mjnav.settings import below

GRID = 61  # controls an axis; odd, so that driving straight on is one of them
GRID_RANGE = (2, 200)  # 200 x 200 controls against 625 pairs of samples take 200 MB


def configure(parser: argparse.ArgumentParser) -> None:
    """The command's options."""
    options.run(parser)
    parser.add_argument(
        "--at", type=float, metavar="TIME", required=True, help="[s]: the tick then, or the last before"
    )
    parser.add_argument(
        "--window", choices=WINDOWS, default="bounds", help="all between the limits (bounds, the default), or reachable"
    )
    parser.add_argument(
        "--grid", type=options.number(int, *GRID_RANGE), default=GRID, metavar="N",
        help=f"N x N controls; {GRID} by default",
    )  # fmt: skip
    parser.add_argument(
        "-o",
        "--output",
        metavar="OUT.png",
        help="where the picture goes, and beside it the arrays; runs/out/ by default",
    )
    parser.add_argument("--json", action="store_true", help="one JSON object in place of text")


def execute(arguments: argparse.Namespace) -> int:
    """Runs the scene up to the moment, and costs and draws the decision that it came to."""
    from mjnav.report.figures import decision_surface_figure

    scenario = load_scenario(arguments.scene, arguments.overrides, controller=arguments.controller, seed=arguments.seed)
    controller = require_candidates(build_controller(scenario), scenario.control.method)
    if arguments.output is None:
        make_out_folder()
        picture = OUT_FOLDER / f"{file_stem(scenario, f'{arguments.at:g}s')}-surface.png"
    else:
        picture = output_path("--output", arguments.output, ".png")
    data = picture.with_suffix(".npz")

    with compile_notice():
        warm_up(scenario)
    with progress(scenario.name, arguments.at) as show, below(file="--at"):
        record = record_at(scenario, arguments.at, progress=show)
    surface = decision_surface(controller, record.seen, record.decision, window=arguments.window, num=arguments.grid)
    about = {
        "scene": scenario.name,
        "controller": scenario.control.method,
        "seed": scenario.seed,
        "time_s": record.truth.time,
        "status": record.decision.status.value,
        "window": arguments.window,
        "grid": arguments.grid,
    }
    status = "" if record.decision.status == Status.OK else f" ({about['status'].replace('_', ' ')})"
    heading = f"{scenario.name}, {about['controller']}, seed {scenario.seed}, {record.truth.time:.2f} s{status}"
    with written(picture) as file:
        decision_surface_figure(surface, heading).savefig(file, format="png")
    with written(data) as file:
        names = np.array(column_names(scenario, record.seen), str)
        np.savez_compressed(file, **_arrays(surface), names=names, **about)
    controls = _controls(surface)
    texts = [heading, *(f"  {name:8}  {_text(control)}" for name, control in controls.items())]
    texts += [f"  picture   {picture}\n  arrays    {data}"]
    document = {**about, **controls, "picture": str(picture), "data": str(data)}
    answer(arguments, document, lambda: print(*texts, sep="\n"))
    return 0


def _controls(surface: DecisionSurface) -> dict[str, dict[str, float | None] | None]:
    """What was chosen, the nominal control, and the cheapest on the grid; null for what is infinite."""
    s, costs = surface, surface.costs
    least = s.minimum
    return {
        "chosen": _control(s.decision.v, s.decision.omega, costs.total.min()),
        "nominal": _control(s.nominal[0], s.nominal[1], costs.total[costs.nominal]),
        "minimum": None if least is None else _control(s.v[least[0]], s.omega[least[1]], s.total[least]),
    }


def _control(v: float, omega: float, total: float) -> dict[str, float | None]:
    return {"v": float(v), "omega": float(omega), "total": float(total) if np.isfinite(total) else None}


def _text(control: dict[str, float | None] | None) -> str:
    if control is None:
        return "nothing on the grid is allowed"
    total = "infinite" if control["total"] is None else f"{control['total']:.4g}"
    return f"v {control['v']:.3f} m/s, ω {control['omega']:.3f} rad/s, total cost {total}"


def _arrays(s: DecisionSurface) -> dict[str, Any]:
    """What the file of arrays has, but for the names of the obstacles."""
    names = ("v", "omega", "goal", "total", "weighted", "nominal", "reachable")
    terms = {"cone": s.cone_term, "lane": s.lane_term, "cone_by_obstacle": s.cone, "lane_by_side": s.lane}
    return {**{name: getattr(s, name) for name in names}, **terms, "chosen": [s.decision.v, s.decision.omega]}
