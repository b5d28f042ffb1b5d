// Pixels that show lamps which are rows of their own: what a level of the glare pyramid got of
// them, to be added with its sign. Definition: taken() of glare/splats.py.
#include "colour.glsl"

uniform sampler2D hdr;
uniform vec2 size;  // texels of the level, with its margin

in vec2 pixel;  // column and row in hdr
in vec2 place;  // in the level
in vec3 share;
out vec3 light;

void main()
{
    light = -share * clean(texelFetch(hdr, ivec2(pixel), 0).rgb);
    gl_PointSize = 1.0;
    gl_Position = vec4((place + 0.5) / size * 2.0 - 1.0, 0.0, 1.0);
}
