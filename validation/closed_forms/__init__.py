"""Exact solutions, independent of the engine; tests use them as well."""
