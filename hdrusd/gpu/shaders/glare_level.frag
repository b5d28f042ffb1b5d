// What the glare pyramid has so far, from coarse levels, and this level, as it is and blurred by
// (1, 2, 1) / 4 along both axes. Definition: glare/pyramid.py.
uniform sampler2D source;  // this level, nearest, black outside
uniform sampler2D veil;    // so far; with COARSER the next level, linear
uniform vec2 texel, veil_texel;  // 1 / size
uniform vec2 plane_corner, plane_texel;  // at distance 1: the frame's corner, sides of a texel
uniform float inverse_step;  // 1 / step of s between nodes
uniform vec2 weights[NODES];  // by s, of the level as it is and blurred

layout(location = 0) out vec4 sum;

void main()
{
    vec2 p = gl_FragCoord.xy * texel;
#ifdef COARSER
    vec2 q = (0.5 * (gl_FragCoord.xy - float(MARGIN)) + float(MARGIN)) * veil_texel;
#else
    vec2 q = p;
#endif
    vec2 place = plane_corner + (gl_FragCoord.xy - float(MARGIN)) * plane_texel;
    float node = clamp((1.0 - pow(1.0 + dot(place, place), -0.75)) * inverse_step,
                       0.0, float(NODES - 1));
    int low = min(int(node), NODES - 2);
    vec2 weight = mix(weights[low], weights[low + 1], node - float(low));
    vec4 centre = textureLod(source, p, 0.0);
    vec4 sides = textureLod(source, p - vec2(texel.x, 0.0), 0.0)
               + textureLod(source, p + vec2(texel.x, 0.0), 0.0)
               + textureLod(source, p - vec2(0.0, texel.y), 0.0)
               + textureLod(source, p + vec2(0.0, texel.y), 0.0);
    vec4 corners = textureLod(source, p - texel, 0.0)
                 + textureLod(source, p + texel, 0.0)
                 + textureLod(source, p + vec2(texel.x, -texel.y), 0.0)
                 + textureLod(source, p + vec2(-texel.x, texel.y), 0.0);
    sum = textureLod(veil, q, 0.0) + (weight.x + 0.25 * weight.y) * centre
        + weight.y * (0.125 * sides + 0.0625 * corners);
}
