"""Indices of the standards and key figures of a result."""
