"""The observer: what an eye sees of a scene, and on which screen. NumPy only."""
