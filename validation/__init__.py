"""What the engine is held to: closed forms, others' numbers, convergence; ``python -m validation``."""
