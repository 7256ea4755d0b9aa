"""The methods of a study compared with one another."""
