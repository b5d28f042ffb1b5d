"""One file a legacy format; each reads into a ``legacy.scene.LegacyScene``."""
