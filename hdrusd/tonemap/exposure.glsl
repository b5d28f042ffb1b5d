// ISO 12232, saturation-based exposure; twin of tonemap/exposure.py

uniform float exposure_scale;  // 1/(cd/m2)

// cd/m2 to display-linear [0, 1]; channels clip alone.
vec3 exposure(vec3 rgb)
{
    return min(rgb * exposure_scale, 1.0);
}
