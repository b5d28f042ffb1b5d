// R = T^gamma D, Lambert, Blinn-Phong (Petit and Bremond 2010, section 3); twin of photometry/reflectance.py

// cd/m2 of a diffuse surface; scale: 1/pi (Lambert) or 1 (petit2010).
vec3 lambert(vec3 reflectance, vec3 lux, float scale)
{
    return reflectance * lux * scale;
}

// N.H from N.L, N.V and L.V (Blinn 1977): |L + V|^2 = 2 + 2 L.V for unit vectors.
float half_cosine(float nl, float nv, float lv)
{
    return (nl + nv) * inversesqrt(max(2.0 + 2.0 * lv, 1e-12));
}

// cd/m2 per lux and unit of specular reflectance, from N.H; scale as above.
float blinn_phong(float cosine, float shininess, float scale)
{
    float lobe = pow(max(cosine, 1e-9), shininess);
    float normal = scale < 1.0 ? (shininess + 8.0) / 8.0 * scale : 1.0;
    return lobe * normal;
}
