"""What legacy files say, in their own numbers, before anyone interprets it."""
