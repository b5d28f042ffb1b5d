// One direction of four blurs at once; see gpu/blurs.py.
#include "colour.glsl"

uniform sampler2D source;   // LUMINANCE: the frame, cd/m2; else what the other direction left
uniform sampler2D weights;  // a vec4 of four kernels' weights a tap
uniform ivec2 last;         // the texel farthest from 0
uniform ivec2 step_;        // (1, 0) or (0, 1)
uniform int taps;           // odd

layout(location = 0) out vec4 four;

void main()
{
    ivec2 at = ivec2(gl_FragCoord.xy) - step_ * (taps / 2);
    four = vec4(0.0);
    for (int tap = 0; tap < taps; ++tap, at += step_) {
        vec4 value = texelFetch(source, clamp(at, ivec2(0), last), 0);
#ifdef LUMINANCE
        value = vec4(luminance(clean(value.rgb)));
#endif
        four += texelFetch(weights, ivec2(tap, 0), 0) * value;
    }
}
