"""What is said of a figure: its type, its unit, what it is, and from where."""

from dataclasses import dataclass

STRING, INTEGER, NUMBER, TRUTH = "string", "int64", "double", "bool"  # as Arrow calls them
LOWER, HIGHER = "lower", "higher"


@dataclass(frozen=True, slots=True, kw_only=True)
class Definition:
    """One figure. `equation` is LaTeX, in the symbols of docs/method/figures.md."""

    text: str  # what it is, in a line
    type: str = NUMBER
    unit: str = ""  # "" of a plain number, a truth or a text
    better: str = ""  # LOWER or HIGHER; "" of what is neither good nor bad
    words: str = ""  # what tables and charts call it; made from its name where empty
    equation: str = ""
    null: str = ""  # when it is null although the episode has a result
    source: str = ""  # author (year)
    over_all: bool = False  # its mean is over all episodes, not only over those that succeeded

    @property
    def about(self) -> str:
        """The definition with when it is null, what is better and the source, in a line."""
        tail = [f"null: {self.null}"] * bool(self.null) + [f"{self.better} is better"] * bool(self.better)
        tail += [self.source] * bool(self.source)
        return self.text + (f" ({'; '.join(tail)})" if tail else "")

    @property
    def line(self) -> str:
        """The same behind the unit."""
        return f"[{self.unit}] {self.about}" if self.unit else self.about
