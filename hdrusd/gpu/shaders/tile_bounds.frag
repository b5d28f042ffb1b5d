// What a tile of the screen shows: nearest and farthest surface, and its highlights.
uniform sampler2D g_normal;    // unit normal; distance along the view axis, m
uniform sampler2D g_diffuse;   // reflectance; gloss code
uniform sampler2D g_specular;  // reflectance at normal incidence; metallic
#ifdef COATED
uniform sampler2D g_extra;     // clear coat: weight, alpha
#endif
layout(location = 0) out vec4 bounds;  // least, largest distance (m); width of the narrowest lobe;
                                       // 1 Blinn-Phong + 2 GGX

void main()
{
    ivec2 size = textureSize(g_normal, 0);
    ivec2 first = ivec2(gl_FragCoord.xy) * TILE;
    ivec2 last = min(first + TILE, size);
    vec2 depth = vec2(1e30, -1.0);
    float lobe = 4.0;
    bool blinn = false, ggx = false;
    for (int y = first.y; y < last.y; ++y)
        for (int x = first.x; x < last.x; ++x) {
            ivec2 at = ivec2(x, y);
            float z = texelFetch(g_normal, at, 0).w;
            bool seen = z > 0.0;
#ifdef COATED
            vec2 coat = texelFetch(g_extra, at, 0).xy;
            bool coated = seen && coat.x > 0.0;
            ggx = ggx || coated;
            lobe = coated ? min(lobe, coat.y) : lobe;
#endif
            depth = seen ? vec2(min(depth.x, z), max(depth.y, z)) : depth;
#ifdef GLOSSY
            float code = texelFetch(g_diffuse, at, 0).w;
#ifndef DIELECTRIC  // then all of them shine
            vec3 ks = texelFetch(g_specular, at, 0).rgb;
            seen = seen && max(ks.r, max(ks.g, ks.b)) > 0.0;
#endif
            ggx = ggx || (seen && code < 0.0);
            blinn = blinn || (seen && code >= 0.0);
            // Half the width of the lobe over the half vector, rad: alpha, or sqrt(2 / (n + 2)).
            float width = code < 0.0 ? -code : sqrt(2.0 / (code + 2.0));
            lobe = seen ? min(lobe, width) : lobe;
#endif
        }
    bounds = vec4(depth, lobe, (blinn ? 1.0 : 0.0) + (ggx ? 2.0 : 0.0));
}
