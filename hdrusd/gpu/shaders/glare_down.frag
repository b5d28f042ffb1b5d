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
    vec4 value = textureLod(below, p * texel, 0.0);
#ifdef FROM_FRAME
    // clean() of colour.glsl, on four channels at a time.
    return mix(vec4(0.0), min(value, BRIGHTEST), greaterThan(value, vec4(0.0)));
#else
    return value;
#endif
}

#ifdef FROM_FRAME
// The sum of those weights whose texels, the first of them at x, lie in the frame.
float inside(float x, float size, vec4 weights)
{
    vec4 place = x + vec4(0.0, 1.0, 2.0, 3.0);
    return dot(weights, step(0.0, place) * step(place, vec4(size)));
}
#endif

void main()
{
#ifdef FROM_FRAME
    const float margin = 0.0;
#else
    const float margin = float(MARGIN);
#endif
    vec2 frame = gl_FragCoord.xy - float(MARGIN);  // of the texel's centre, in texels
#if STEP == 0
    vec2 p = frame + margin;
    const vec4 taps = vec4(1.0, 0.0, 0.0, 0.0);
    level = at(p);
#else
    vec2 p = 2.0 * frame + margin - 1.5;
    const vec4 taps = vec4(0.125, 0.375, 0.375, 0.125);
    level = vec4(0.0);
    for (int y = 0; y < 4; ++y) {
        vec2 q = p + vec2(0.0, y);
        vec4 outer = at(q) + at(q + vec2(3.0, 0.0));
        vec4 inner = at(q + vec2(1.0, 0.0)) + at(q + vec2(2.0, 0.0));
        level += taps[y] * (taps.x * outer + taps.y * inner);
    }
#endif
#ifdef FROM_FRAME
    vec2 size = 1.0 / texel;
    level.a = inside(p.x, size.x, taps) * inside(p.y, size.y, taps);
#endif
}
