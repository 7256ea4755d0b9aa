"""Cells of CSV files that are safe to open in a spreadsheet."""

STARTS = ("=", "+", "-", "@", "\t", "\r", "\n", "＝", "＋", "－", "＠")  # of a formula (OWASP, CSV injection)


def neutral(value: object) -> object:
    """The cell; a text that a spreadsheet would run as a formula gets an apostrophe before it, a number does not.

    No name of mjnav's begins like a formula, so this needs no option.
    """
    if not isinstance(value, str) or not value.startswith(STARTS):
        return value
    try:
        float(value)
    except ValueError:
        return f"'{value}"
    return value
