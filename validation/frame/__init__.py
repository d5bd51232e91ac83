"""Frame of the validation: a case, the table, the catalogue, shared runs."""
