// Petit and Bremond 2010, eq. 1, with UsdLux cones; twin of photometry/light.py

// rad; Abramowitz and Stegun 4.4.46, error below 2e-8, because drivers' acos is worse.
float angle_from_cosine(float cosine)
{
    float x = min(abs(cosine), 1.0);
    float p = 0.0066700901 - 0.0012624911 * x;
    p = p * x - 0.0170881256;
    p = p * x + 0.0308918810;
    p = p * x - 0.0501743046;
    p = p * x + 0.0889789874;
    p = p * x - 0.2145988016;
    p = (p * x + 1.5707963050) * sqrt(1.0 - x);
    return cosine < 0.0 ? 3.14159265358979 - p : p;
}

// Share of the axial intensity that a cone lets pass at an angle of this cosine: full up to
// inner (rad), nothing beyond inner + 1 / inverse_width.
float cone_factor(float cosine, float inner, float inverse_width)
{
    float t = clamp((angle_from_cosine(cosine) - inner) * inverse_width, 0.0, 1.0);
    return 1.0 - t * t * (3.0 - 2.0 * t);
}

// Share of the axial intensity by UsdLux focus, OpenGL's spot exponent.
float focus_factor(float cosine, float exponent)
{
    return pow(max(abs(cosine), 1e-9), exponent);
}

// From a surface point (m) to the light, unnormalised; w 1: place, w 0: unit direction.
vec3 light_vector(vec3 position, float w, vec3 point)
{
    return position - point * w;
}

// lux per candela: cos(theta) / d^2, from the cosine and 1 / d^2 (1/m2);
// inverse_radius2 (1/m2) bounds it inside the lamp.
float illuminance(float cosine, float inverse_d2, float inverse_radius2)
{
    return max(cosine, 0.0) * min(inverse_d2, inverse_radius2);
}
