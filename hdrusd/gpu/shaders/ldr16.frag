// Shader 2: HDR frame in cd/m2 to code values of 16 bits, which need no dither.
#include "gpu/shaders/shown.glsl"

layout(location = 0) out uvec4 code;

void main()
{
    ivec2 p = ivec2(gl_FragCoord.xy);
    code = uvec4(ENCODE(mapped(light(p), p)) * 65535.0 + 0.5, 65535.0);
}
