// Luminance of single pixels; see gpu/foveal.py.
#include "colour.glsl"

uniform sampler2D hdr;          // cd/m2, nearest
uniform vec2 texel;             // 1 / size of hdr
uniform usampler2D places;      // pixels, x to the right and y down
uniform int top_row, row_step;  // row of hdr at the top of the picture, and +1 or -1

layout(location = 0) out float y;

void main()
{
    uvec2 p = texelFetch(places, ivec2(gl_FragCoord.xy), 0).xy;
    vec2 place = (vec2(float(p.x), float(top_row + row_step * int(p.y))) + 0.5) * texel;
    y = luminance(clean(textureLod(hdr, place, 0.0).rgb));
}
