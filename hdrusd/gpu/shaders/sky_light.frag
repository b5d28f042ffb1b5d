// The diffuse part of the sky's light with what the surroundings leave of it, in cd/m2: the lux
// under open sky times the share that sky_occlusion.frag found.
#include "colour.glsl"
#include "photometry/reflectance.glsl"
#include "photometry/sky.glsl"
#include "gpu/shaders/gbuffer.glsl"

in vec2 window;
uniform sampler2D arriving;
uniform vec3 sky_lux[18];
uniform float lambert_scale;
uniform sampler2D g_scattered;  // gbuffer.frag's

layout(location = 0) out vec4 hdr;

void main()
{
    float depth;
    vec3 n = g_normal_at(window, depth);
    vec4 sum = textureLod(arriving, window, 0.0);
    vec3 open = ambient_lux(n, sky_lux);
    vec3 lux = sum.rgb * (luminance(open) / max(sum.a, 1e-30));
    hdr = vec4(lambert(textureLod(g_scattered, window, 0.0).rgb, lux, lambert_scale), 0.0);
}
