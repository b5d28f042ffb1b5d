// Shader 1: E_k = I_k cos(theta) / d^2 (Petit and Bremond 2010, eq. 1), diffuse and specular,
// added up over one batch of lights. Result in cd/m2.
#include "photometry/light.glsl"
#include "photometry/reflectance.glsl"
// MICROFACET
#include "gpu/shaders/gbuffer.glsl"

in vec2 window;
flat in vec4 data[FIRST * ROWS + CONED * 3];
layout(location = 0) out vec4 hdr;

uniform float lambert_scale;  // 1/pi, or 1 for petit2010

// What of a surface every light needs.
struct Surface {
    vec3 p;          // m, relative to the eye
    vec3 n;          // unit normal
    vec3 v;          // unit vector to the eye
    float nv;
    float gloss;     // code of g_diffuse.w: shininess, or minus alpha
    float links;     // bits
};

// What of a light arrives there.
struct Arrival {
    vec3 lux;        // on the surface, unobstructed or not, as far as diffuse reflection goes
    vec3 gloss_lux;  // the same for the highlight
    vec3 l;          // unit vector that the highlight takes for the light's direction
    float nl;
};

// A light of three texels: position, 1/radius^2 | intensity, inner | axis, 1/width.
#define CONE_ARRIVAL(i) \
    Arrival a; \
    POINT_ARRIVAL(vec4(data[FIRST * ROWS + (i) * 3].xyz, 1.0), data[FIRST * ROWS + (i) * 3 + 1].xyz, \
                  data[FIRST * ROWS + (i) * 3].w) \
    a.lux *= cone_factor(-dot(a.l, data[FIRST * ROWS + (i) * 3 + 2].xyz), \
                         data[FIRST * ROWS + (i) * 3 + 1].w, data[FIRST * ROWS + (i) * 3 + 2].w); \
    a.gloss_lux = a.lux;
#define POINT_ARRIVAL(place, candela, inverse_radius2) \
    a.l = light_vector((place).xyz, (place).w, s.p); \
    float inverse_d = inversesqrt(max(dot(a.l, a.l), 1e-20)); \
    a.l *= inverse_d; \
    a.nl = dot(s.n, a.l); \
    a.lux = (candela) * illuminance(a.nl, inverse_d * inverse_d, inverse_radius2);

#if defined(SPECIAL)
// SPECIAL_INCLUDE
#define ARRIVAL(i) Arrival a = special_arrival(s, (i) * ROWS);
#elif defined(FOCUS)
// Four texels: position, w | intensity, 1/radius^2 | axis, exponent | inner, 1/width, 0, 0.
#define ARRIVAL(i) \
    Arrival a; \
    POINT_ARRIVAL(data[(i) * 4], data[(i) * 4 + 1].xyz, data[(i) * 4 + 1].w) \
    float cosine = -dot(a.l, data[(i) * 4 + 2].xyz); \
    a.lux *= cone_factor(cosine, data[(i) * 4 + 3].x, data[(i) * 4 + 3].y) \
             * focus_factor(cosine, data[(i) * 4 + 2].w); \
    a.gloss_lux = a.lux;
#else
// Two texels: position, w | intensity, 1/radius^2.
#define ARRIVAL(i) \
    Arrival a; \
    POINT_ARRIVAL(data[(i) * 2], data[(i) * 2 + 1].xyz, data[(i) * 2 + 1].w) \
    a.gloss_lux = a.lux;
#endif

// The highlight: BLINN, GGX or both in a tile; sums of luminance.
#if defined(BLINN) || defined(GGX)
vec3 ks;

#ifdef COATED
vec2 coat;  // weight, alpha
#endif
vec3 highlight(Surface s, Arrival a)
{
    float vl = dot(s.v, a.l);
    float nh = half_cosine(a.nl, s.nv, vl);
    vec3 sum = vec3(0.0);
#ifdef GGX
    vec3 ggx = ggx_lobe(ks, f90, -s.gloss, a.nl, s.nv, nh, vl, lambert_scale);
#ifdef COATED
    ggx = coated(ggx, coat, a.nl, s.nv, nh, vl, lambert_scale);
#endif
#endif
#if defined(BLINN) && defined(GGX)
    return a.gloss_lux * (s.gloss < 0.0 ? ggx : ks * blinn_phong(nh, s.gloss, lambert_scale));
#elif defined(GGX)
    return a.gloss_lux * ggx;
#else
    return a.gloss_lux * ks * blinn_phong(nh, s.gloss, lambert_scale);
#endif
}
#define REFLECT sum += a.lux; gloss += highlight(s, a);
#else
#define REFLECT sum += a.lux;
#endif
#define ADD(i) { ARRIVAL(i) REFLECT }
#define ADD_CONE(i) { CONE_ARRIVAL(i) REFLECT }

// ALL_FIRST and ALL_CONED, two of these, apply X to each light of their kind in the batch.
#define ALL0(X)
#define ALL1(X) X(0)
#define ALL3(X) ALL1(X) X(1) X(2)
#define ALL4(X) ALL3(X) X(3)
#define ALL5(X) ALL4(X) X(4)
#define ALL7(X) ALL5(X) X(5) X(6)
#define ALL8(X) ALL7(X) X(7)
#define ALL10(X) ALL8(X) X(8) X(9)
#define ALL15(X) ALL10(X) X(10) X(11) X(12) X(13) X(14)

void main()
{
    Surface s;
    float depth;
    s.n = g_normal_at(window, depth);
    s.p = g_position_at(window, depth);
    s.v = g_toward_eye(s.p);
    s.nv = dot(s.n, s.v);
    vec4 diffuse = textureLod(g_diffuse, window, 0.0);
    s.gloss = diffuse.w;
    vec3 sum = vec3(0.0), gloss = vec3(0.0);
#if defined(LINKED) || defined(COATED)
    vec4 extra = textureLod(g_extra, window, 0.0);
    s.links = extra.z;
#endif
#if defined(BLINN) || defined(GGX)
    vec4 specular = textureLod(g_specular, window, 0.0);
    ks = specular.rgb;


#ifdef COATED
    coat = extra.xy;
#endif
#endif
    ALL_FIRST(ADD)
    ALL_CONED(ADD_CONE)
    hdr = vec4(lambert(diffuse.rgb, sum, lambert_scale) + gloss, 0.0);
}
