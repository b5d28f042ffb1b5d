"""The account of a conversion: what a person needs to defend it, and to make it better."""
