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

// Share of the axial intensity sent at an angle of the given cosine; inner, outer: rad.
float cone_factor(float cosine, float inner, float outer, float exponent)
{
    float theta = angle_from_cosine(cosine);
    float t = clamp((theta - inner) / max(outer - inner, 1e-6), 0.0, 1.0);
    float fade = 1.0 - t * t * (3.0 - 2.0 * t);
    if (exponent > 0.0)  // a power costs as much as all the rest of a light
        fade *= pow(max(abs(cosine), 1e-9), exponent);
    return fade;
}

// From a surface point (m) to the light, unnormalised; w 1: place, w 0: unit direction.
vec3 light_vector(vec3 position, float w, vec3 point)
{
    return position - point * w;
}

// lux per candela: cos(theta) / d^2, from the cosine and the square of the distance (m2);
// radius in m bounds it inside the lamp.
float illuminance(float cosine, float d2, float radius)
{
    return max(cosine, 0.0) / max(d2, radius * radius);
}
