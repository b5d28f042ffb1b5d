"""The paper's section 3 in NumPy: lights in candela, textures as reflectance."""
