"""The constant data of a run, assembled and factorised."""
