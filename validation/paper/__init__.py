"""The paper's case: moving window against the traditional full-length model."""
