"""Cases, one file a publication or closed form."""
