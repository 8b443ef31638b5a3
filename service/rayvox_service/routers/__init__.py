"""Routes of the HTTP API, one resource per file."""
