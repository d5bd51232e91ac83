"""Exact solutions, written apart from the engine; tests use them as well."""
