"""Rails, fastenings and slabs: parameters and host matrices."""
