// Shader 2: HDR frame in cd/m2 to code values of 16 bits, which need no dither.
#include "gpu/shaders/shown.glsl"

layout(location = 0) out uvec4 code;

void main()
{
    code = uvec4(shown(ivec2(gl_FragCoord.xy)) * 65535.0 + 0.5, 65535.0);
}
