"""Constant data of a run, assembled and factorised."""
