"""A first photometry file for a database: what may be a lamp in it, and how strong such are."""
