// What arrives of a light that needs more than its place and its beam. Its texels:
// position, w | intensity, 1/radius^2 | axis, exponent | x, inner | y, 1/width | factor on
// diffuse, factor on specular, link, radius (of a distant light: tangent of half its angle);
// then those of its shadow (SHADOW_ROWS), then those of its profile.
// First: a file is included once, and in a branch that is not taken it would be nowhere.
#include "photometry/arc.glsl"
#if defined(RECT) || defined(DISK) || defined(SPHERE) || defined(CYLINDER) || defined(DISTANT)
#include "photometry/area.glsl"
#endif
#ifdef SHADOWED
#include "gpu/shaders/shadow.glsl"
#endif
#ifdef PROFILE
#include "photometry/profile.glsl"
uniform sampler2D profile_atlas;
#endif
#ifndef SHADOW_ROWS
#define SHADOW_ROWS 0
#endif

Arrival special_arrival(Surface s, int at)
{
    vec4 place = data[at], candela = data[at + 1], axis = data[at + 2], x = data[at + 3],
         y = data[at + 4], more = data[at + 5];
    Arrival a;
    vec3 to = light_vector(place.xyz, place.w, s.p);
    float inverse_d = inversesqrt(max(dot(to, to), 1e-20));
    a.l = to * inverse_d;
    a.nl = dot(s.n, a.l);
    vec3 strength = candela.xyz;
#ifdef BEAM
    float cosine = -dot(a.l, axis.xyz);
    strength *= cone_factor(cosine, x.w, y.w) * focus_factor(cosine, axis.w);
#endif
#ifdef PROFILE
    const int at_profile = 6 + SHADOW_ROWS;
    vec3 away = -vec3(dot(a.l, normalize(x.xyz)), dot(a.l, normalize(y.xyz)), dot(a.l, axis.xyz));
    strength *= profile_candela(profile_atlas, data[at + at_profile], data[at + at_profile + 1], away);
#endif
#ifdef LINKED
    strength *= float((int(s.links) >> (int(more.z) - 1)) & 1);
#endif
#ifdef SHADOWED
    vec4 rows[SHADOW_ROWS];
    for (int k = 0; k < SHADOW_ROWS; ++k)
        rows[k] = data[at + 6 + k];
    ShadowLight lamp = ShadowLight(place.xyz, axis.xyz, x.xyz, y.xyz, more.w);
    strength *= visibility(s.p, s.n, s.plane, lamp, rows);
#endif
#if defined(RECT)
    float received = rect_illuminance(to, s.n, axis.xyz, x.xyz, y.xyz);
#elif defined(DISK)
    float received = disk_illuminance(to, s.n, axis.xyz, x.xyz, y.xyz);
#elif defined(SPHERE)
    float received = sphere_illuminance(to, s.n, more.w);
#elif defined(CYLINDER)
    float received = cylinder_illuminance(to, s.n, x.xyz, more.w);
#elif defined(DISTANT)
    float sine = more.w * inversesqrt(1.0 + more.w * more.w);
    float received = sphere_illuminance(a.l, s.n, sine);
#else
    float received = illuminance(a.nl, inverse_d * inverse_d, candela.w);
#endif
#if defined(SIZED) && (defined(BLINN) || defined(GGX))
    // For its highlight the light is the point of it that is nearest to the mirrored ray.
    vec3 ray = 2.0 * s.nv * s.n - s.v;
    a.middle = a.nl;
#if defined(RECT)
    a.spread = vec2(STRAIGHT, STRAIGHT * STRAIGHT) * spread(to, s.v, x.xyz, y.xyz);
    to = rect_point(to, ray, axis.xyz, x.xyz, y.xyz);
#elif defined(DISK)
    a.spread = spread(to, s.v, x.xyz, y.xyz);
    to = disk_point(to, ray, axis.xyz, x.xyz, y.xyz);
#elif defined(SPHERE)
    a.spread = sphere_spread(to, s.v, more.w);
    to = sphere_point(to, ray, more.w);
#elif defined(CYLINDER)
    vec3 across = cross(x.xyz, to);
    across *= more.w * inversesqrt(max(dot(across, across), 1e-20));
    a.spread = vec2(STRAIGHT, STRAIGHT * STRAIGHT) * spread(to, s.v, x.xyz, across);
    to = cylinder_point(to, ray, x.xyz, more.w);
#else
    a.spread = sphere_spread(a.l, s.v, sine);
    to = sphere_point(a.l, ray, sine);
#endif
    a.l = to * inversesqrt(max(dot(to, to), 1e-20));
    a.nl = dot(s.n, a.l);
#endif
    a.lux = strength * (received * more.x);
    a.gloss_lux = strength * (received * more.y);
    return a;
}
