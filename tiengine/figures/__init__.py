"""Figures of results: one kind a file, each a function from a result to a matplotlib figure."""
