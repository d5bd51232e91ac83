"""Figures of results: one kind per file, each a function from a result to a matplotlib figure."""
