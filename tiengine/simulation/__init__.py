"""Runs: tasks, time loop, worker processes, one result file."""

import time

IMPORT_BEGAN = time.perf_counter()
"""Instant at which the first of these modules was imported [s]: importing is part of the wall time of a run."""
