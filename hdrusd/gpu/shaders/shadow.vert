// Casters into the tiles of the shadow atlas that see them: an instance is a tile.
// A row of texels a tile: four columns of its matrix to clip space; middle x, y and half width in the
// atlas' clip space, tangent; x, y, z of its eye from the lamp in its frame, lamp's radius^2.
// Both tables are 2^TABLE texels wide: division takes a software device longer than all else here.
#define ROW 6
#ifndef TILES
in vec3 in_position;
#ifdef CUTOUT
in vec2 in_uv;
out vec2 uv;
#endif
#endif
uniform sampler2D tiles;
uniform isampler2D pairs;  // rows of ``tiles``, instance after instance
uniform int first;         // where the instances of this call begin
uniform float aspect;      // width of the atlas by its height

vec4 texel(int row, int k)
{
    int at = row * ROW + k;
    return texelFetch(tiles, ivec2(at & ((1 << TABLE) - 1), at >> TABLE), 0);
}

void main()
{
    int at = first + gl_InstanceID;
    int row = texelFetch(pairs, ivec2(at & ((1 << TABLE) - 1), at >> TABLE), 0).r;
    vec4 area = texel(row, 4);
#ifdef TILES
    // The tile itself, as a strip of two triangles as far away as can be.
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;
    gl_Position = vec4(area.xy + corner * area.z * vec2(1.0, aspect), 1.0, 1.0);
#else
    vec4 p = vec4(in_position, 1.0), ball = texel(row, 5);
    vec4 clip = vec4(dot(texel(row, 0), p), dot(texel(row, 1), p), dot(texel(row, 2), p),
                     dot(texel(row, 3), p));
    // Nothing leaves its tile, and nothing inside the lamp casts.
    gl_ClipDistance[0] = clip.w + clip.x;
    gl_ClipDistance[1] = clip.w - clip.x;
    gl_ClipDistance[2] = clip.w + clip.y;
    gl_ClipDistance[3] = clip.w - clip.y;
    vec3 from_lamp = vec3(clip.xy * area.w, clip.w) + ball.xyz;
    gl_ClipDistance[4] = dot(from_lamp, from_lamp) - ball.w;
    gl_Position = vec4(clip.xy * area.z * vec2(1.0, aspect) + area.xy * clip.w, clip.zw);
#ifdef CUTOUT
    uv = in_uv;
#endif
#endif
}
