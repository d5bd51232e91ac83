"""Profiling: time of each stage of the step, compared with the roofline of the machine."""
