"""Track irregularity: spectra, random and measured track."""
