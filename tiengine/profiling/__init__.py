"""Profiling: where the time of a step goes, held against the machine."""
