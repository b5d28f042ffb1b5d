"""Photometric night rendering of low-dynamic-range 3D databases on OpenUSD."""

__version__ = "0.1.0"
