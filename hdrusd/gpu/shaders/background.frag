// The sky itself, where no surface is seen, in cd/m2.
#include "photometry/sky.glsl"
#include "gpu/shaders/gbuffer.glsl"

in vec2 window;
uniform sampler2D sky;   // lat-long, v up
uniform mat3 axes;       // world to the dome's own
uniform vec3 factor;     // cd/m2 a unit of the texture
uniform float level;     // of its mip maps: as many texels as pixels

layout(location = 0) out vec4 hdr;

void main()
{
    vec3 ray = orthographic ? forward : g_position_at(window, 1.0);
    hdr = vec4(factor * textureLod(sky, sky_uv(axes * ray), level).rgb, 0.0);
}
