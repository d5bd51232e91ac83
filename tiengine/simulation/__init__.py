"""Runs: tasks, time loop, worker processes, one result file."""

import time

IMPORT_BEGAN = time.perf_counter()
"""When the first of these modules was imported [s]: loading the engine is part of what a user waits for."""
