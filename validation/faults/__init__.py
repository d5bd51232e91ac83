"""Faults: runs that are killed, starved of disk, disturbed; one command: ``python -m validation.faults``."""
