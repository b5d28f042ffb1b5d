// AgX, base look (Sobotka 2022); twin of tonemap/agx.py
#include "colour.glsl"
#include "tonemap/exposure.glsl"

// Exposed values > 0 of AgX's primaries to its code values.
vec3 agx_curve(vec3 v)
{
    vec3 x = clamp((log2(v) + 12.47393) / 16.499999, 0.0254, 1.0);
    vec3 upper = ((-17.86 * x + 78.01) * x - 126.7) * x + 92.06;
    return (((upper * x - 28.72) * x + 4.361) * x - 0.1718) * x + 0.002857;
}

// Exposed RGB >= 0 to display-linear [0, 1]; matrices with a line a channel.
vec3 agx_base(vec3 rgb)
{
    const mat3 INSET = mat3(0.856627153315983, 0.0951212405381588, 0.0482516061458583,
                            0.137318972929847, 0.761241990602591, 0.101439036467562,
                            0.11189821299995, 0.0767994186031903, 0.811302368396859);
    const mat3 OUTSET = mat3(1.127100582, -0.110606643, -0.016493939,
                             -0.141329763, 1.157823702, -0.016493939,
                             -0.141329763, -0.110606643, 1.251936407);
    vec3 inset = max(to_rec2020(rgb) * INSET, 1e-10);
    vec3 code = max(agx_curve(inset) * OUTSET, 0.0);
    return clamp(from_rec2020(pow(code, vec3(2.2))), 0.0, 1.0);
}

// cd/m2 to display-linear [0, 1].
vec3 agx(vec3 rgb)
{
    return agx_base(exposed(rgb));
}
