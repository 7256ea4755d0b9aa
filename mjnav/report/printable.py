"""Text from anywhere, for terminals and pages."""


def printable(value: object, instead: str = "\N{REPLACEMENT CHARACTER}") -> str:
    """Text of which nothing moves the cursor or turns the line around: a foreign file may hold anything."""
    return "".join(c if c.isprintable() else instead for c in str(value))
