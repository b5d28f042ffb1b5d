"""Glare: light that the eye scatters from where it falls to where it does not. NumPy only."""
