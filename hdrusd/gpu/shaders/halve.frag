// The next level of a mip chain, top row first: means of 2 x 2 texels, the last one of an odd
// side twice.
#include "colour.glsl"

uniform sampler2D image;  // nearest, clamped
uniform vec2 texel;       // 1 / its size
uniform vec2 row;         // of the image, from one counted from the top: row.x + row.y * that

layout(location = 0) out vec4 mean;

vec4 texel_at(vec2 place)
{
    vec4 value = textureLod(image, vec2(place.x, row.x + row.y * place.y) * texel, 0.0);
#ifdef CLEAN
    value.rgb = clean(value.rgb);
#endif
    return value;
}

void main()
{
    vec2 at = 2.0 * gl_FragCoord.xy;
    mean = 0.25 * (texel_at(at - 0.5) + texel_at(at + vec2(0.5, -0.5))
                   + texel_at(at + vec2(-0.5, 0.5)) + texel_at(at + 0.5));
}
