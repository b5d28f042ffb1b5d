// Shader 1: E_k = I_k cos(theta) / d^2 (Petit and Bremond 2010, eq. 1), diffuse and specular,
// added up over one batch of lights. Result in cd/m2.
#include "photometry/light.glsl"
#include "photometry/reflectance.glsl"
#include "photometry/microfacet.glsl"

uniform sampler2D g_normal;    // unit normal; distance along the view axis, m
uniform sampler2D g_diffuse;   // reflectance; shininess, or minus alpha of GGX
uniform sampler2D g_specular;  // reflectance at normal incidence; metallic
// What is the same all over is made by the vertices: each number that a pixel reads of a
// uniform costs a software device more than a multiplication.
noperspective in vec2 window;
noperspective in vec3 ray;     // m; orthographic: from the eye's plane, else along to distance 1
#ifdef ORTHOGRAPHIC
uniform vec3 forward;          // unit vector along the view axis
#endif
flat in vec4 data[FIRST * FIRST_ROWS + CONED * CONED_ROWS];
layout(location = 0) out vec4 hdr;

uniform float lambert_scale;  // 1/pi, or 1 for petit2010
#if defined(LINKED) || defined(COATED)
uniform sampler2D g_extra;    // clear coat: weight, alpha; light links
#endif

// Of LAMPS and BEAMS, which are of one make: colour, strongest channel 1, and 1/radius^2.
uniform vec4 lamp_make, beam_make;
uniform vec2 beam_edge;       // inner, 1/width

// Where nothing else has a colour, that of one make is multiplied when its lamps are added up.
#if (defined(GGX) && !defined(DIELECTRIC)) || (FIRST > 0 && !defined(LAMPS)) \
    || (CONED > 0 && !defined(BEAMS))
#define LUX vec3
#define OF_MAKE(make, strength) ((make).rgb * (strength))
#else
#define LUX float
#define OF_MAKE(make, strength) (strength)
#define COLOURLESS
#endif

// What of a surface every light needs.
struct Surface {
    vec3 p;          // m, relative to the eye
    vec3 n;          // unit normal
#ifdef SHADOWED
    vec3 plane;      // that of the surface without its bumps
#endif
    vec3 v;          // unit vector to the eye
    float nv;
    float gloss;     // code of g_diffuse.w: shininess, or minus alpha
    float links;     // bits
};

#if defined(RECT) || defined(DISK) || defined(SPHERE) || defined(CYLINDER) || defined(DISTANT)
#define SIZED
#endif
// After a lobe of alpha^2: it is that of the light's representative point.
#if defined(SIZED) && (defined(BLINN) || defined(GGX))
#include "photometry/highlight.glsl"
#define OF_SIZE(alpha2) * highlight_share(lobe_share(a.spread, 1.0, alpha2), a.nl, a.middle)
#else
#define OF_SIZE(alpha2)
#endif

// What of a light arrives there.
struct Arrival {
    LUX lux;         // on the surface, unobstructed or not, as far as diffuse reflection goes
    LUX gloss_lux;   // the same for the highlight
    vec3 l;          // unit vector that the highlight takes for the light's direction
    float nl;
#ifdef SIZED
    vec2 spread;     // by how much the size of the light moves the half vector (highlight.glsl)
    float middle;    // N.L of its centre
#endif
};

#define CONED_TEXEL(i, k) data[FIRST * FIRST_ROWS + (i) * CONED_ROWS + (k)]
#ifdef BEAMS
// Two texels: position, strength | axis, 0.
#define CONE_ARRIVAL(i) \
    Arrival a; \
    POINT_ARRIVAL(vec4(CONED_TEXEL(i, 0).xyz, 1.0), OF_MAKE(beam_make, CONED_TEXEL(i, 0).w), \
                  beam_make.w) \
    a.lux *= cone_factor(-dot(a.l, CONED_TEXEL(i, 1).xyz), beam_edge.x, beam_edge.y); \
    a.gloss_lux = a.lux;
#else
// Three texels: position, 1/radius^2 | intensity, inner | axis, 1/width.
#define CONE_ARRIVAL(i) \
    Arrival a; \
    POINT_ARRIVAL(vec4(CONED_TEXEL(i, 0).xyz, 1.0), CONED_TEXEL(i, 1).xyz, CONED_TEXEL(i, 0).w) \
    a.lux *= cone_factor(-dot(a.l, CONED_TEXEL(i, 2).xyz), CONED_TEXEL(i, 1).w, \
                         CONED_TEXEL(i, 2).w); \
    a.gloss_lux = a.lux;
#endif
#define POINT_ARRIVAL(place, candela, inverse_radius2) \
    a.l = light_vector((place).xyz, (place).w, s.p); \
    float inverse_d = inversesqrt(max(dot(a.l, a.l), 1e-20)); \
    a.l *= inverse_d; \
    a.nl = dot(s.n, a.l); \
    a.lux = (candela) * illuminance(a.nl, inverse_d * inverse_d, inverse_radius2);

#if defined(SPECIAL)
#include "gpu/shaders/special_light.glsl"
#define ARRIVAL(i) Arrival a = special_arrival(s, (i) * FIRST_ROWS);
#elif defined(FOCUS)
// Four texels: position, w | intensity, 1/radius^2 | axis, exponent | inner, 1/width, 0, 0.
#define ARRIVAL(i) \
    Arrival a; \
    POINT_ARRIVAL(data[(i) * 4], data[(i) * 4 + 1].xyz, data[(i) * 4 + 1].w) \
    float cosine = -dot(a.l, data[(i) * 4 + 2].xyz); \
    a.lux *= cone_factor(cosine, data[(i) * 4 + 3].x, data[(i) * 4 + 3].y) \
             * focus_factor(cosine, data[(i) * 4 + 2].w); \
    a.gloss_lux = a.lux;
#elif defined(LAMPS)
// One texel: position, strength.
#define ARRIVAL(i) \
    Arrival a; \
    POINT_ARRIVAL(vec4(data[i].xyz, 1.0), OF_MAKE(lamp_make, data[i].w), lamp_make.w) \
    a.gloss_lux = a.lux;
#else
// Two texels: position, w | intensity, 1/radius^2.
#define ARRIVAL(i) \
    Arrival a; \
    POINT_ARRIVAL(data[(i) * 2], data[(i) * 2 + 1].xyz, data[(i) * 2 + 1].w) \
    a.gloss_lux = a.lux;
#endif

// What reflection a tile has: none but diffuse, BLINN, GGX, or both.
LUX sum = LUX(0.0);      // lux that diffuse reflection gets
LUX gloss = LUX(0.0);    // cd/m2 of highlights
#if defined(DIELECTRIC)
uniform float dielectric;  // reflectance at normal incidence of all there is, none of it metal
float ks, f90;
float alpha2, gain;
#elif defined(GGX)
vec3 ks, f90;
float alpha2, gain;
#ifdef COATED
float coat, coat_alpha2, coat_gain;
#endif
#elif defined(BLINN)
vec3 ks;
#endif

void reflect_light(Surface s, Arrival a)
{
#if defined(GGX)
    vec2 half_way = half_squares(s.n, a.l, s.v, a.nl, s.nv);
    float weight = schlick_weight(0.5 * sqrt(half_way.y));
#ifdef DIELECTRIC
    float f = ks + (f90 - ks) * weight;
#else
    vec3 f = fresnel(ks, f90, weight);
#endif
    float lobe = ggx_lobe_of_half(gain, alpha2, a.nl, half_way) OF_SIZE(alpha2);
#ifdef BLINN
    bool blinn = s.gloss >= 0.0;
    float nh = half_cosine(a.nl, s.nv, dot(s.v, a.l));
    lobe = blinn ? blinn_phong(nh, s.gloss, lambert_scale) OF_SIZE(blinn_alpha2(s.gloss)) : lobe;
    vec3 below = blinn ? vec3(1.0) : 1.0 - f;
    f = blinn ? ks : f;
#elif defined(DIELECTRIC)
    float below = 1.0 - f, shine = f * lobe;
#else
    vec3 below = 1.0 - f;
#endif
#ifndef DIELECTRIC
    vec3 shine = f * lobe;
#endif
#ifdef COATED
    float c = coat_reflectance(coat, weight);
    below *= 1.0 - c;
    float coat_lobe = ggx_lobe_of_half(coat_gain, coat_alpha2, a.nl, half_way) OF_SIZE(coat_alpha2);
    shine = layered(shine, vec3(c), coat_lobe);
#endif
    sum += a.lux * below;
    gloss += a.gloss_lux * shine;
#else
    sum += a.lux;
#ifdef BLINN
    float nh = half_cosine(a.nl, s.nv, dot(s.v, a.l));
    gloss += a.gloss_lux * (blinn_phong(nh, s.gloss, lambert_scale) OF_SIZE(blinn_alpha2(s.gloss)));
#endif
#endif
}

#define REFLECT reflect_light(s, a);
#define ADD(i) { ARRIVAL(i) REFLECT }
#define ADD_CONE(i) { CONE_ARRIVAL(i) REFLECT }

#if defined(SHADOWED) && defined(BUMPED)
// Place relative to the eye of what a neighbouring pixel shows, m; 0 where there is none.
vec3 place_beside(vec2 pixel, vec3 its_ray, out float depth)
{
    vec2 at = window + pixel;
    bool there = min(at.x, at.y) > 0.0 && max(at.x, at.y) < 1.0;
    depth = there ? textureLod(g_normal, at, 0.0).w : 0.0;
#ifdef ORTHOGRAPHIC
    return its_ray + forward * depth;
#else
    return its_ray * depth;
#endif
}

// From a pixel's place to that of a neighbour in its plane: of two the one nearer in depth.
vec3 step_in_plane(vec3 p, float depth, vec2 pixel, vec3 turn)
{
    float a, b;
    vec3 ahead = place_beside(pixel, ray + turn, a), back = place_beside(-pixel, ray - turn, b);
    return abs(a - depth) <= abs(b - depth) ? ahead - p : p - back;
}

// The normal of the triangle that is seen; n where it has no neighbour.
vec3 flat_normal(vec3 p, float depth, vec3 n, vec3 v)
{
    vec2 pixel = 1.0 / vec2(textureSize(g_normal, 0));
    vec3 found = cross(step_in_plane(p, depth, vec2(pixel.x, 0.0), dFdx(ray)),
                       step_in_plane(p, depth, vec2(0.0, pixel.y), dFdy(ray)));
    found *= inversesqrt(max(dot(found, found), 1e-30));
    float side = dot(found, v);
    return abs(side) > 1e-3 ? found * sign(side) : n;
}
#endif

void main()
{
    Surface s;
    vec4 normal = textureLod(g_normal, window, 0.0);
    s.n = normal.xyz;
#ifdef ORTHOGRAPHIC
    s.p = ray + forward * normal.w;
    s.v = -forward;
#else
    s.p = ray * normal.w;
    s.v = -normalize(ray);
#endif
    s.nv = dot(s.n, s.v);
#if defined(SHADOWED) && defined(BUMPED)
    s.plane = flat_normal(s.p, normal.w, s.n, s.v);
#elif defined(SHADOWED)
    s.plane = s.n;
#endif
    vec4 diffuse = textureLod(g_diffuse, window, 0.0);
    s.gloss = diffuse.w;
#if defined(LINKED) || defined(COATED)
    vec4 extra = textureLod(g_extra, window, 0.0);
    s.links = extra.z;
#endif
#if defined(DIELECTRIC)
    ks = dielectric;
    f90 = grazing_reflectance(vec3(dielectric), 0.0).r;
#elif defined(BLINN) || defined(GGX)
    vec4 specular = textureLod(g_specular, window, 0.0);
    ks = specular.rgb;
#ifdef GGX
    f90 = grazing_reflectance(ks, specular.w);
#endif
#endif
#ifdef GGX
    alpha2 = max(s.gloss * s.gloss, 1e-6);  // code 0, of matte surfaces between: no 0 / 0
    gain = ggx_gain(s.nv, alpha2, lambert_scale);
#ifdef COATED
    coat = extra.x;
    coat_alpha2 = extra.y * extra.y;
    coat_gain = ggx_gain(s.nv, coat_alpha2, lambert_scale);
#endif
#endif
    ALL_FIRST(ADD)
#ifdef COLOURLESS
    vec3 lux = lamp_make.rgb * sum, shine = lamp_make.rgb * gloss;
    sum = gloss = 0.0;
#endif
    ALL_CONED(ADD_CONE)
#ifdef COLOURLESS
    lux += beam_make.rgb * sum;
    shine += beam_make.rgb * gloss;
#else
    vec3 lux = sum, shine = gloss;
#endif
#if defined(BLINN) && !defined(GGX)
    shine *= ks;
#endif
    hdr = vec4(lambert(diffuse.rgb, lux, lambert_scale) + shine, 0.0);
}
