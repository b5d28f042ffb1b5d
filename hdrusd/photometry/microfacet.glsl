// GGX microfacets (Walter et al. 2007) with a clear coat; twin of photometry/microfacet.py

// F90: reflectance at grazing incidence from F0, at normal incidence.
vec3 grazing_reflectance(vec3 f0, float metallic)
{
    float dielectric = min(50.0 * max(max(f0.r, f0.g), f0.b), 1.0);
    return mix(vec3(dielectric), f0, metallic);
}

// (1 - cosine)^5 of Schlick 1994, from V.H.
float schlick_weight(float cosine)
{
    float x = max(1.0 - cosine, 0.0);
    float x2 = x * x;
    return x2 * x2 * x;
}

vec3 fresnel(vec3 f0, vec3 f90, float weight)
{
    return f0 + (f90 - f0) * weight;
}

// Of H = L + V, x: the square of its part in the surface, y: its own, 4 (V.H)^2. Unit vectors;
// nl, nv: N.L, N.V.
vec2 half_squares(vec3 normal, vec3 light, vec3 view, float nl, float nv)
{
    vec3 h = light + view;
    vec3 s = h - normal * max(nl + nv, 0.0);
    return vec2(dot(s, s), max(dot(h, h), 1e-8));
}

// c + sqrt(alpha^2 + (1 - alpha^2) c^2); 1 / (that of N.L times that of N.V) is G / (4 N.L N.V).
float smith_side(float cosine, float alpha2)
{
    float c = max(cosine, 0.0);
    return c + sqrt(alpha2 + (1.0 - alpha2) * c * c);
}

// What ggx_lobe needs of a pixel; scale: 1/pi, or 1 for petit2010.
float ggx_gain(float nv, float alpha2, float scale)
{
    return scale * alpha2 / smith_side(nv, alpha2);
}

// cd/m2 per lux where all is reflected: D G / (4 N.L N.V); squares: half_squares.
float ggx_lobe_of_half(float gain, float alpha2, float nl, vec2 squares)
{
    float d = alpha2 * squares.y + (1.0 - alpha2) * squares.x;
    return gain * (squares.y * squares.y) / (d * d * smith_side(nl, alpha2));
}

// cd/m2 per lux of a layer that reflects f in a lobe, and of what lies below it.
vec3 layered(vec3 below, vec3 f, float lobe)
{
    return below + f * (lobe - below);
}

// Reflectance of a clear coat of this amount.
float coat_reflectance(float amount, float weight)
{
    return amount * (0.04 + 0.96 * weight);
}
