"""Bracketed photographs become one picture in cd/m2: read, merged, calibrated."""
