// Shader 1: E_k = I_k cos(theta) / d^2 (Petit and Bremond 2010, eq. 1), diffuse and specular,
// added up over one batch of lights. Result in cd/m2.
#include "photometry/light.glsl"
#include "photometry/reflectance.glsl"

uniform sampler2D g_position, g_normal, g_diffuse, g_specular;
uniform float lambert_scale;  // 1/pi, or 1 for petit2010
uniform vec3 toward_eye;      // orthographic: unit vector to the eye; perspective: zero

flat in vec4 data[BATCH * ROWS];
layout(location = 0) out vec4 hdr;

// Rows of a light: position, w | intensity rgb, radius | axis, exponent | inner, outer, -, -
#ifdef CONES
#define CONE(i) * cone_factor(-dot(l, data[(i) * ROWS + 2].xyz), data[(i) * ROWS + 3].x, \
                              data[(i) * ROWS + 3].y, data[(i) * ROWS + 2].w)
#else
#define CONE(i)
#endif

#define SHADE(i) { \
    vec3 l = light_vector(data[(i) * ROWS].xyz, data[(i) * ROWS].w, p); \
    float d2 = max(dot(l, l), 1e-20); \
    l *= inversesqrt(d2); \
    float nl = dot(n, l); \
    float e = illuminance(nl, d2, data[(i) * ROWS + 1].w) CONE(i); \
    vec3 lux = data[(i) * ROWS + 1].xyz * e; \
    sum += lux; \
    if (glossy && e > 0.0) { \
        float nh = half_cosine(nl, nv, dot(l, v)); \
        gloss += lux * blinn_phong(nh, shininess, lambert_scale); \
    } }

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 position = texelFetch(g_position, pixel, 0);
    vec3 p = position.xyz;
    float shininess = position.w;
    vec3 n = texelFetch(g_normal, pixel, 0).xyz;
    vec3 rho = texelFetch(g_diffuse, pixel, 0).rgb;
    vec3 ks = texelFetch(g_specular, pixel, 0).rgb;
    vec3 v = toward_eye == vec3(0.0) ? -normalize(p) : toward_eye;
    float nv = dot(n, v);
    bool glossy = ks.r + ks.g + ks.b > 0.0;
    vec3 sum = vec3(0.0), gloss = vec3(0.0);
    SHADE(0)
#if BATCH > 1
    SHADE(1) SHADE(2) SHADE(3) SHADE(4) SHADE(5) SHADE(6)
#endif
#if BATCH > 7
    SHADE(7) SHADE(8) SHADE(9) SHADE(10) SHADE(11) SHADE(12) SHADE(13) SHADE(14)
#endif
    hdr = vec4(lambert(rho, sum, lambert_scale) + ks * gloss, 0.0);
}
