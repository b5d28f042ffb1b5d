// Sums along the rows of a frame, one for each foveal sample across; see gpu/foveal.py.
#include "colour.glsl"

uniform sampler2D hdr;      // cd/m2, nearest
uniform vec2 texel;         // 1 / size of hdr
uniform int width, samples; // pixels and foveal samples across

layout(location = 0) out vec4 sum;

// Of the pixel x in the row of this fragment.
vec3 light(int x)
{
    return clean(textureLod(hdr, vec2(float(x) + 0.5, gl_FragCoord.y) * texel, 0.0).rgb);
}

// First pixel of a sample; as eye/foveal.py borders().
int border(int i)
{
    return (2 * i * width + samples) / (2 * samples);
}

void main()
{
    int i = int(gl_FragCoord.x);
    int begin = border(i), last = border(i + 1) - 1;
    vec3 total = vec3(0.0);
    for (int x = 0; x < EACH; ++x) {
        total += light(begin + x);
    }
    // Every sample has EACH = width / samples pixels, or one more.
    vec3 more = light(last);
    sum = vec4(total + (last - begin == EACH ? more : vec3(0.0)), 1.0);
}
