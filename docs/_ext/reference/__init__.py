"""One file a reference page: `markdown()` gives its text."""
