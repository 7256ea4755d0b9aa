"""Text from anywhere, made safe for terminals and pages: a log, a run file or a file name may hold any character."""

from unicodedata import category

# Controls, formats, lone surrogates, private and unassigned characters, line and paragraph separators
NOT_TEXT = ("Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp")


def printable(value: object, instead: str = "\N{REPLACEMENT CHARACTER}", *, keep: str = "") -> str:
    """The text of a value without characters that move the cursor, colour the text or turn it around.

    Each of them is replaced by `instead`, so that the width stays; those in `keep` are kept.
    """
    text = str(value)
    if text.isprintable():
        return text
    return "".join(c if c in keep or category(c) not in NOT_TEXT else instead for c in text)
