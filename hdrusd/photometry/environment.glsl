// The split sum of Karis 2013 for GGX; twin of photometry/environment.py

// Level of the blurred surroundings that a lobe of this alpha looks up, 0 (sharp) to 5.
float blur_level(float alpha)
{
    return clamp(5.0 + log2(max(alpha, 1e-4)) * 0.756470797, 0.0, 5.0);
}

// Where the table of what a lobe reflects of a white sky has the entry of N.V and alpha.
vec2 table_place(float nv, float alpha)
{
    return (sqrt(clamp(vec2(nv, alpha), 0.0, 1.0)) * 31.0 + 0.5) / 32.0;
}

// Where a lobe mostly looks (Lagarde and de Rousiers 2014); not of unit length.
vec3 main_direction(vec3 normal, vec3 mirrored, float alpha)
{
    float smoothness = 1.0 - alpha;
    return normal + (mirrored - normal) * (smoothness * (sqrt(smoothness) + alpha));
}

// Share of a white sky that a lobe sends to the eye, from an entry of the table.
vec3 reflected(vec3 f0, vec3 f90, vec2 entry)
{
    return f0 * entry.x + f90 * entry.y;
}

// Mean of (1 - V.H)^5 over light from everywhere alike: what the diffuse part loses of it.
float mean_schlick(float nv)
{
    return (((8.96e-3 * nv - 4.363e-2) * nv + 8.644e-2) * nv - 7.985e-2) * nv + 2.816e-2;
}
