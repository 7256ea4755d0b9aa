"""Cells of CSV files that a spreadsheet opens, too."""

STARTS = ("=", "+", "-", "@", "\t", "\r", "\n", "＝", "＋", "－", "＠")  # of a formula (OWASP, CSV injection)


def neutral(value: object) -> object:
    """The cell, a text that a spreadsheet would run as a formula behind an apostrophe; numbers stay what they are.

    Always, and not on request: no name of mjnav's begins like that, and who opens a foreign file asks for nothing.
    """
    if not isinstance(value, str) or not value.startswith(STARTS):
        return value
    try:
        float(value)
    except ValueError:
        return f"'{value}"
    return value
