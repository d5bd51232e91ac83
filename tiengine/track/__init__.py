"""Track: rails, fastenings, slabs, mortar and their defects."""
