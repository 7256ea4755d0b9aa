"""The public names of the modules that users import, from their source: signatures, docstrings, fields, comments."""

import ast
import inspect
import textwrap
from collections.abc import Iterator, Mapping
from dataclasses import is_dataclass
from enum import Enum
from importlib import import_module
from typing import Any

from .markdown import escape

# module -> what it is for
MODULES: Mapping[str, str] = {
    "mjnav": "What most programs need.",
    "mjnav.loop.result": "What `mjnav.run` returns.",
    "mjnav.log.read.log": "What `mjnav.open_log` returns.",
    "mjnav.gym": "Gymnasium environments; extra: `gym`.",
    "mjnav.messages": "What the parts of the loop hand to one another.",
    "mjnav.control": "Controllers by name.",
    "mjnav.control.base": "What controllers of your own derive from.",
    "mjnav.control.parameters": "What the parameters of a controller of your own derive from.",
    "mjnav.settings": "Marks of a parameter's type: ranges, choices, descriptions.",
    "mjnav.settings.plugins": "How a class of your own is named and found.",
    "mjnav.rkhs": "The distance between distributions.",
    "mjnav.constraints": "Constraints of obstacles, walls and lanes.",
    "mjnav.noise": "Distributions and profiles.",
}


def markdown() -> str:
    """A section for each module."""
    return "\n".join(_section(import_module(name), text) for name, text in MODULES.items())


def _section(module: Any, text: str) -> str:
    parts = [f"## `{module.__name__}`", "", text, ""]
    for name in public_names(module):
        parts += _entry(f"{module.__name__}.{name}", getattr(module, name), _colons(3))
    return "\n".join(parts)


def public_names(module: Any) -> list[str]:
    """Those of `__all__` that no other section has, or else the classes and functions that the module defines."""
    if hasattr(module, "__all__"):
        elsewhere = MODULES.keys() - {module.__name__}
        return [name for name in module.__all__ if getattr(getattr(module, name), "__module__", "") not in elsewhere]
    return [
        name
        for name, value in vars(module).items()
        if not name.startswith("_")
        and getattr(value, "__module__", None) == module.__name__
        and (inspect.isclass(value) or inspect.isfunction(value))
    ]


def _colons(depth: int) -> str:
    return ":" * (8 - depth)


def _entry(name: str, value: Any, fence: str) -> Iterator[str]:
    """A class with its members, a function, or a value."""
    if inspect.isclass(value):
        yield f"{fence}{{py:class}} {name}{_class_signature(value)}\n"
        yield document(inspect.getdoc(value) if value.__doc__ else "")
        yield from _fields(value)
        for member, attribute in vars(value).items():
            if not member.startswith("_") and attribute.__doc__:
                yield from _member(member, attribute, fence[1:])
    elif inspect.isfunction(value):
        yield f"{fence}{{py:function}} {name}{_signature(_tree(value))}\n"
        yield document(inspect.getdoc(value))
    else:
        yield f"{fence}{{py:data}} {name}\n"
    yield f"{fence}\n"


def _member(name: str, attribute: Any, fence: str) -> Iterator[str]:
    """A method or property of a class."""
    if isinstance(attribute, property) and attribute.fget is not None:
        yield f"{fence}{{py:property}} {name}\n"
    else:
        function = attribute.__func__ if isinstance(attribute, classmethod | staticmethod) else attribute
        if not inspect.isfunction(function):
            return
        yield f"{fence}{{py:method}} {name}{_signature(_tree(function), method=True)}\n"
    yield document(inspect.getdoc(attribute))
    yield f"{fence}\n"


def _tree(value: Any) -> Any:
    """The definition of a function or class, as it was written."""
    return ast.parse(textwrap.dedent(inspect.getsource(inspect.unwrap(value)))).body[0]


def _signature(tree: ast.FunctionDef, *, method: bool = False) -> str:
    arguments = tree.args
    if method and arguments.args and not any(ast.unparse(d) == "staticmethod" for d in tree.decorator_list):
        arguments.args = arguments.args[1:]
    returned = f" -> {ast.unparse(tree.returns)}" if tree.returns is not None else ""
    return f"({ast.unparse(arguments)}){returned}"


def _class_signature(value: type) -> str:
    own = vars(value).get("__init__")
    if is_dataclass(value) or issubclass(value, Enum) or not inspect.isfunction(own):
        return ""
    return _signature(_tree(own), method=True)


def _fields(value: type) -> Iterator[str]:
    """The fields of a dataclass and the members of an enumeration, each with the comment behind it."""
    if not (is_dataclass(value) or issubclass(value, Enum)):
        return
    lines = textwrap.dedent(inspect.getsource(value)).splitlines()
    for node in _tree(value).body:
        if isinstance(node, ast.AnnAssign | ast.Assign):
            comment = lines[(node.end_lineno or node.lineno) - 1][node.end_col_offset or 0 :].partition("#")[2].strip()
            yield f"`{_field(node)}`\n: {escape(comment) or _described(node) or '–'}\n"


def _field(node: ast.AnnAssign | ast.Assign) -> str:
    """name: type = default; of a type with marks, the type alone."""
    if isinstance(node, ast.Assign):
        return ast.unparse(node)
    annotation: ast.expr = node.annotation
    if _is_marked(annotation):
        annotation = annotation.slice.elts[0]  # type: ignore[attr-defined]
    default = f" = {ast.unparse(node.value)}" if node.value is not None else ""
    return f"{ast.unparse(node.target)}: {ast.unparse(annotation)}{default}"


def _described(node: ast.AnnAssign | ast.Assign) -> str:
    """The string among the marks of a field's type."""
    if isinstance(node, ast.Assign) or not _is_marked(node.annotation):
        return ""
    marks = node.annotation.slice.elts[1:]  # type: ignore[attr-defined]
    return next((escape(m.value) for m in marks if isinstance(m, ast.Constant) and isinstance(m.value, str)), "")


def _is_marked(annotation: ast.expr) -> bool:
    return isinstance(annotation, ast.Subscript) and ast.unparse(annotation.value) == "Annotated"


def document(text: str | None) -> str:
    """A docstring as Markdown: indented lines are code, a star at the beginning of a line is a list's."""
    lines = []
    for line in (text or "").splitlines():
        if line.startswith("    "):
            lines.append(line)
        elif line.lstrip().startswith("* "):
            star = line.index("*") + 1
            lines.append(line[:star] + escape(line[star:]))
        else:
            lines.append(escape(line))
    return "\n".join(lines) + "\n"
