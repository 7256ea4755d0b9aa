"""The methods: one file a row of the README's table."""
