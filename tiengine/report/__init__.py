"""Reports: pages and tables of a result or of a contact geometry."""
