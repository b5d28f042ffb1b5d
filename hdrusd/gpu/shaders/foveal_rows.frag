// Sums along the rows of a frame, one for each foveal sample across; see gpu/foveal.py.
#include "colour.glsl"

uniform sampler2D hdr;      // cd/m2, nearest
uniform vec2 texel;         // 1 / size of hdr
uniform int width, samples; // pixels and foveal samples across

layout(location = 0) out vec4 sum;

// First pixel of a sample; as eye/foveal.py borders().
int border(int i)
{
    return (2 * i * width + samples) / (2 * samples);
}

void main()
{
    ivec2 at = ivec2(gl_FragCoord.xy);
    int end = border(at.x + 1);
    vec3 total = vec3(0.0);
    for (int x = border(at.x); x < end; ++x) {
        total += clean(textureLod(hdr, (vec2(x, at.y) + 0.5) * texel, 0.0).rgb);
    }
    sum = vec4(total, 1.0);
}
