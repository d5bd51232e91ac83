"""Reader files: their layout, writing and reading, journal, checkpoints, exports."""
