"""The traditional full-length model (Zhai's modal superposition), the yardstick of the moving window."""
