"""Scenarios: everything that a user can state about a run, checked."""
