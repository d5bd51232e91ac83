"""Scenarios: validated description of a run."""
