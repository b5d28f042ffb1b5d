// A sky in a lat-long picture (Ramamoorthi and Hanrahan 2001); twin of photometry/sky.py

// Texture coordinates, v up, of a unit vector in the dome's axes.
vec2 sky_uv(vec3 direction)
{
    float across = length(direction.xz);
    return 0.5 + vec2(-atan(direction.x, direction.z) / 6.28318530717959,
                      atan(direction.y, across) / 3.14159265358979);
}

// Lux on a surface under open sky; 18 coefficients, in the axes of the unit normal.
vec3 ambient_lux(vec3 normal, vec3 coefficients[18])
{
    float x = normal.x, y = normal.y, z = normal.z;
    float xx = x * x, yy = y * y, zz = z * z, xy = x * y, yz = y * z, xz = x * z;
    vec3 sum = coefficients[0] + coefficients[1] * y + coefficients[2] * z + coefficients[3] * x
        + coefficients[4] * xy + coefficients[5] * yz + coefficients[6] * (3.0 * zz - 1.0)
        + coefficients[7] * xz + coefficients[8] * (xx - yy)
        + coefficients[9] * (xy * (xx - yy)) + coefficients[10] * (yz * (3.0 * xx - yy))
        + coefficients[11] * (xy * (7.0 * zz - 1.0)) + coefficients[12] * (yz * (7.0 * zz - 3.0))
        + coefficients[13] * ((35.0 * zz - 30.0) * zz + 3.0)
        + coefficients[14] * (xz * (7.0 * zz - 3.0))
        + coefficients[15] * ((xx - yy) * (7.0 * zz - 1.0))
        + coefficients[16] * (xz * (xx - 3.0 * yy))
        + coefficients[17] * (xx * (xx - 3.0 * yy) - yy * (3.0 * xx - yy));
    return max(sum, 0.0);
}
