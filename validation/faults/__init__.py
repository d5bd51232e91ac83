"""Fault injection: runs that are killed, disturbed or out of disk space; ``python -m validation.faults``."""
