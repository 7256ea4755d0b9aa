"""The JSON Schemas of run files and study files, with the parameters of every method."""

from collections.abc import Iterator

from mjnav import control
from mjnav.config.schema import Schema, json_schema, partial, table_schema, with_variants
from mjnav.control import make_controller
from mjnav.messages import RobotLimits
from mjnav.scenarios.layout.schema import with_draws
from mjnav.scenarios.spec import Control, Scenario
from mjnav.study.study_file import StudyFile

_PERIOD = 1.0 / Control().rate  # [s] for which defaults are shown


def run_schema() -> Schema:
    """Of a run file. [control] takes the parameters of its method, and any of a user's own."""
    schema = {"title": "mjnav run file", **with_draws(json_schema(Scenario))}
    tables = schema["$defs"]
    tables["Control"]["properties"]["method"] = _method(tables["Control"]["properties"]["method"])
    defaults = {name: make_controller(name, RobotLimits(), _PERIOD).parameters for name in control.names()}
    kinds = {name: table_schema(type(own), tables, own) for name, own in defaults.items()}
    tables["Control"] = with_variants(tables["Control"], "method", kinds, default=Control().method)
    trace = tables["Latency"]["properties"]["trace"]
    description = trace.pop("description")
    tables["Latency"]["properties"]["trace"] = {"description": description, "anyOf": [trace, {"type": "string"}]}
    return schema


def study_schema() -> Schema:
    """Of a study file. What it sets are keys of a run file, and of [control] where a method sets them."""
    schema, run = {"title": "mjnav study file", **json_schema(StudyFile)}, run_schema()
    tables = schema["$defs"]
    values = partial(run, "set", lambda one: one)
    arrays = partial(run, "grid", lambda one: {"type": "array", "items": one, "minItems": 1, "uniqueItems": True})
    for name, some in (("set", values), ("grid", arrays)):
        tables |= some.pop("$defs")
        own = tables[f"Control {name}"]["properties"]
        groups = {key: one for key, one in some["properties"].items() if "$ref" in one or "anyOf" in one}
        tables[name] = some
        both = {key: {"anyOf": [groups[key], own[key]]} for key in groups.keys() & own.keys()}  # prediction
        tables[f"method's {name}"] = {"type": "object", "properties": {**groups, **own, **both}}
        for place, table in (
            (schema["properties"], name),
            (tables["SettingEntry"]["properties"], name),
            (tables["MethodEntry"]["properties"], f"method's {name}"),
        ):
            if name in place:
                place[name] = {"description": place[name]["description"], "$ref": f"#/$defs/{table}"}
    tables["Search"] = _search(tables["Search"], run["$defs"]["Control"]["properties"])
    tables |= _missing(schema, run["$defs"])
    controller = tables["MethodEntry"]["properties"]["controller"]
    tables["MethodEntry"]["properties"]["controller"] = _method(controller)
    return schema


def _search(schema: Schema, parameters: Schema) -> Schema:
    """A search: its own keys, a draw for every parameter of a method, and tables of other keys of a run file."""
    drawn = {key: {**_description(one), "$ref": "#/$defs/Draw"} for key, one in parameters.items() if key != "method"}
    return {**schema, "properties": {**drawn, **schema["properties"]}, "additionalProperties": {"type": "object"}}


def _description(schema: Schema) -> Schema:
    return {"description": schema["description"]} if "description" in schema else {}


def _missing(schema: Schema, definitions: Schema) -> Schema:
    """Of `definitions`, those that a schema refers to and lacks: tables of an array that is given as a whole."""
    found: Schema = {}
    while missing := [name for name in _references([schema, found]) if name not in {**schema["$defs"], **found}]:
        found |= {name: definitions[name] for name in missing}
    return found


def _references(part: object) -> Iterator[str]:
    """The names of the definitions that a part of a schema refers to."""
    for key, value in part.items() if isinstance(part, dict) else enumerate(part if isinstance(part, list) else ()):
        if key == "$ref":
            yield str(value).removeprefix("#/$defs/")
        else:
            yield from _references(value)


def _method(schema: Schema) -> Schema:
    """A method's name, or a user's own class."""
    return {**schema, "anyOf": [{"enum": list(control.names())}, {"pattern": ":"}]}
