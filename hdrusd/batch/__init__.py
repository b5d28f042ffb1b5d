"""Many databases at once: what becomes of which file (``plan``), and by whom (``workers``)."""
