// The diffuse part of the sky's light with what the surroundings leave of it, in cd/m2: the lux
// under open sky times the share that sky_occlusion.frag found.
#include "photometry/environment.glsl"
#include "photometry/microfacet.glsl"
#include "photometry/reflectance.glsl"
#include "photometry/sky.glsl"
#include "gpu/shaders/gbuffer.glsl"

in vec2 window;
uniform sampler2D arriving;
uniform vec3 sky_lux[18];
uniform float lambert_scale;
#ifdef COATED
uniform sampler2D g_extra;
#endif

layout(location = 0) out vec4 hdr;

void main()
{
    float depth;
    vec3 n = g_normal_at(window, depth);
    vec4 sum = textureLod(arriving, window, 0.0);
    vec3 open = ambient_lux(n, sky_lux);
    vec3 lux = sum.rgb * (dot(open, vec3(0.2126, 0.7152, 0.0722)) / max(sum.a, 1e-30));
    vec4 diffuse = textureLod(g_diffuse, window, 0.0);
    vec3 light = lambert(diffuse.rgb, lux, lambert_scale);
    float bent = mean_schlick(clamp(dot(n, g_toward_eye(g_position_at(window, depth))), 0.0, 1.0));
    vec4 f0 = textureLod(g_specular, window, 0.0);
    if (diffuse.w < 0.0)
        light *= 1.0 - fresnel(f0.rgb, grazing_reflectance(f0.rgb, f0.w), bent);
#ifdef COATED
    light *= 1.0 - coat_reflectance(textureLod(g_extra, window, 0.0).x, bent);
#endif
    hdr = vec4(light, 0.0);
}
