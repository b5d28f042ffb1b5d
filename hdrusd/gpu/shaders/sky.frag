// What GGX surfaces mirror of their surroundings, in cd/m2: the split sum of Karis 2013.
// With PICTURE the sky of a texture, else light from everywhere alike.
#include "colour.glsl"
#include "photometry/environment.glsl"
#include "photometry/microfacet.glsl"
#include "photometry/sky.glsl"
#include "gpu/shaders/gbuffer.glsl"

in vec2 window;
uniform sampler2D reflected_table;
uniform vec3 factor;       // cd/m2; with PICTURE a unit of the texture
uniform float scale;       // 1, or pi for petit2010
#ifdef PICTURE
uniform sampler2D blurred; // lat-long, v up; its mip maps are blurred_levels
uniform mat3 axes;         // world to the dome's own
#endif
#ifdef COATED
uniform sampler2D g_extra; // clear coat: weight, alpha
#endif
#ifdef OCCLUDED
uniform sampler2D arriving; // sky_occlusion.frag's
#endif

layout(location = 0) out vec4 hdr;

// cd/m2 that a lobe sends to the eye, for F0 and F90.
vec3 mirrored(vec3 n, vec3 v, float nv, float alpha, vec3 f0, vec3 f90)
{
    vec3 light = factor * reflected(f0, f90, textureLod(reflected_table, table_place(nv, alpha), 0.0).rg);
#ifdef PICTURE
    vec3 towards = axes * main_direction(n, 2.0 * nv * n - v, alpha);
    light *= textureLod(blurred, sky_uv(towards), blur_level(alpha)).rgb;
#endif
    return light;
}

void main()
{
    float depth;
    vec3 n = g_normal_at(window, depth);
    vec3 v = g_toward_eye(g_position_at(window, depth));
    float nv = clamp(dot(n, v), 0.0, 1.0);
    float gloss = textureLod(g_diffuse, window, 0.0).w;
    vec4 f0 = textureLod(g_specular, window, 0.0);
    float alpha = clamp(-gloss, 1e-3, 1.0);
    vec3 light = mirrored(n, v, nv, alpha, f0.rgb, grazing_reflectance(f0.rgb, f0.w));
#ifdef COATED
    vec2 coat = textureLod(g_extra, window, 0.0).xy;
    light *= 1.0 - coat_reflectance(coat.x, mean_schlick(nv));
    light += mirrored(n, v, nv, coat.y, vec3(0.04 * coat.x), vec3(coat.x));
#endif
#ifdef OCCLUDED
    // A mirror is taken to see as much of the sky as the surface does all round.
    vec4 sum = textureLod(arriving, window, 0.0);
    light *= luminance(sum.rgb) / max(sum.a, 1e-30);
#endif
    hdr = vec4(gloss < 0.0 ? light * scale : vec3(0.0), 0.0);
}
