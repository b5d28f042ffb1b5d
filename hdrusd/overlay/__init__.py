"""A stage that is converted stays as it is; what is photometric comes as a layer over it."""
