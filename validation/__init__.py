"""Verification and validation: closed forms, published numbers, convergence; ``python -m validation``."""
