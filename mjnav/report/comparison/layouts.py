"""How many layouts a table has: the unit of evidence, as seeds of one layout differ in their noise alone."""


def layouts(num: int) -> str:
    """In words."""
    return "one layout" if num == 1 else f"{num} layouts"
