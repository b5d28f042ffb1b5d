// ISO 12232, saturation-based exposure; twin of tonemap/exposure.py

uniform float exposure_scale;  // 1/(cd/m2)

const float BRIGHTEST_EXPOSED = 1e9;  // exposed RGB that stands for all above

// cd/m2 to display-linear [0, 1]; channels clip alone.
vec3 exposure(vec3 rgb)
{
    return min(rgb * exposure_scale, 1.0);
}

// cd/m2 to exposed RGB, 1 being a diffuse white.
vec3 exposed(vec3 rgb)
{
    return min(rgb * exposure_scale, BRIGHTEST_EXPOSED);
}
