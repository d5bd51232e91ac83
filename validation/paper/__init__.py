"""The paper's case: moving window beside the traditional full-length model."""
