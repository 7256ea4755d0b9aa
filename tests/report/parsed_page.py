"""A page, as a browser takes it apart."""

from dataclasses import dataclass, field
from html.parser import HTMLParser

VOID = frozenset({"br", "hr", "img", "input", "link", "meta"})  # elements that have no end


@dataclass
class Element:
    tag: str
    attributes: dict[str, str | None]
    parts: list[str] = field(default_factory=list)

    @property
    def text(self) -> str:
        """Its text and that of all within it."""
        return "".join(self.parts)


class ParsedPage(HTMLParser):
    """The elements of a page in order; tags that do not match fail the test."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.elements: list[Element] = []
        self._open: list[Element] = []
        self.feed(page)
        assert self._open == []

    def handle_starttag(self, tag, attrs):
        self.elements.append(Element(tag, dict(attrs)))
        if tag not in VOID:
            self._open.append(self.elements[-1])

    def handle_startendtag(self, tag, attrs):
        self.elements.append(Element(tag, dict(attrs)))

    def handle_endtag(self, tag):
        assert self._open.pop().tag == tag

    def handle_data(self, data):
        for element in self._open:
            element.parts.append(data)

    def all(self, tag: str, **attributes: str) -> list[Element]:
        """The elements of a tag with these attributes."""
        return [e for e in self.elements if e.tag == tag and attributes.items() <= e.attributes.items()]

    @property
    def policy(self) -> str:
        """Its content security policy."""
        (policy,) = self.all("meta", **{"http-equiv": "Content-Security-Policy"})
        return policy.attributes["content"] or ""

    @property
    def code(self) -> list[str]:
        """Its scripts that are run."""
        return [script.text for script in self.all("script") if "type" not in script.attributes]
