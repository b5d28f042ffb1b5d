// A level of the glare pyramid from the one below, by (1, 3, 3, 1) / 8 along both axes; or, with
// FROM_FRAME, level STEP (0 or 1) from the frame, with a fourth channel that is 1 inside it.
// Definition: glare/pyramid.py.
#ifdef FROM_FRAME
#include "colour.glsl"
#endif

uniform sampler2D below;  // nearest, black outside
uniform vec2 texel;       // 1 / size of below

layout(location = 0) out vec4 level;

vec4 at(vec2 p)
{
#ifdef FROM_FRAME
    bool inside = all(greaterThan(p, vec2(0.0))) && all(lessThan(p, vec2(1.0)));
    return inside ? vec4(clean(textureLod(below, p, 0.0).rgb), 1.0) : vec4(0.0);
#else
    return textureLod(below, p, 0.0);
#endif
}

void main()
{
#ifdef FROM_FRAME
    const float margin = 0.0;
#else
    const float margin = float(MARGIN);
#endif
    vec2 frame = gl_FragCoord.xy - float(MARGIN);  // of the texel's centre, in texels
#if STEP == 0
    level = at((frame + margin) * texel);
#else
    vec2 p = 2.0 * frame + margin - 1.5;
    level = vec4(0.0);
    for (int y = 0; y < 4; ++y) {
        vec2 q = p + vec2(0.0, y);
        vec4 outer = at(q * texel) + at((q + vec2(3.0, 0.0)) * texel);
        vec4 inner = at((q + vec2(1.0, 0.0)) * texel) + at((q + vec2(2.0, 0.0)) * texel);
        level += (y == 0 || y == 3 ? 0.125 : 0.375) * (0.125 * outer + 0.375 * inner);
    }
#endif
}
