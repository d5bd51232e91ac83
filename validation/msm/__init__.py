"""The traditional full-length model (Zhai's modal superposition), the reference of the moving window."""
