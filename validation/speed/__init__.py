"""Speed: cases as data (``cases.toml``), one command that runs them: ``python -m validation.speed``."""
