// Pixels between four samples of the foveal image, as finely as the eye resolves them there.
// FIRST: between the frame itself and level 1 of its mip chain, which is top row first.
#include "colour.glsl"
#include "eye/acuity.glsl"

uniform sampler2D fine;      // the frame, or a level of its mip chain; nearest, clamped
uniform vec2 fine_texel;     // 1 / its size
uniform sampler2D coarse;    // the next level
uniform vec2 coarse_texel;
uniform float number, last;  // of the level; of the last that has a next one
uniform float scale;         // texels of the level a pixel
uniform vec2 density;        // samples a pixel
uniform vec2 row;            // counted from the top: row.x + row.y * that of the frame

flat in vec4 corners;
flat in vec2 cell;

layout(location = 0) out vec4 seen;

void main()
{
    vec2 at = gl_FragCoord.xy;
    vec2 part = at * density - 0.5 - cell;
    float level = mix(mix(corners.x, corners.y, part.x), mix(corners.z, corners.w, part.x), part.y);
    level = max(level, 0.0);
    if (min(floor(level), last) != number)
        discard;
    vec2 place = vec2(at.x, row.x + row.y * at.y) * scale;
#ifdef FIRST
    vec4 near = textureLod(fine, at * fine_texel, 0.0);
    near.rgb = clean(near.rgb);
#else
    vec4 near = mip_texel(fine, place, fine_texel);
#endif
    seen = mix(near, mip_texel(coarse, 0.5 * place, coarse_texel), level - number);
}
