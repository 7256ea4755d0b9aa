"""Plug-ins for mjnav. pyproject.toml says their names; nothing is imported before it is used."""
