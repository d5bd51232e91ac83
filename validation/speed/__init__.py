"""Speed measurements: cases as data (``cases.toml``), run by ``python -m validation.speed``."""
