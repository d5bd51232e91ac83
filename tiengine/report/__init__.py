"""Reports: pages and tables about a result or a contact geometry."""
