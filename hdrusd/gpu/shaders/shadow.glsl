// How much of a light a surface point sees, from shadow maps (gpu/shadows.py): 0 to 1.
// One of SHADOW_SPOT, SHADOW_CUBE, SHADOW_ORTHO; and for a light of some size one of SHADOW_RECT,
// SHADOW_DISK, SHADOW_BALL, SHADOW_TUBE, SHADOW_SUN with SAMPLES points on it.

uniform sampler2DShadow shadow_atlas;  // linear filter: the share of four texels that is lit
uniform float shadow_aspect;           // width of the atlas by its height
uniform float shadow_rounding;         // m: of the casters' positions as float32

#ifdef SHADOW_ORTHO
#define SHADOW_ROWS 6
#else
#define SHADOW_ROWS 2
#endif

#if defined(SHADOW_RECT) || defined(SHADOW_DISK) || defined(SHADOW_BALL) || defined(SHADOW_TUBE) \
    || defined(SHADOW_SUN)
#define SHADOW_AREA
#define SAMPLE_ROWS 4
// Points in units of the light's vectors; how deep each is in the lamp, in radii.
uniform vec4 shadow_samples[SAMPLES];
#else
#define SAMPLE_ROWS 1
#endif

struct ShadowLight {
    vec3 place;    // m, relative to the eye; unit vector towards a distant light
    vec3 axis;     // the way it shines
    vec3 x, y;     // its vectors (scene.LIGHT)
    float radius;  // m; of a distant light: tangent of half its angle
};

// Depths are rounded to 24 bits, and so is 1 - near / w here.
const float DEPTH_ROUNDING = 3.0 / 16777216.0;

// Texels by which a point is lifted off its surface, beside what the slope asks for: a shading
// normal is not the triangle's.
const float LIFT = 0.5;

// Place in a tile: -1 to 1; column, row: which tile of the block.
float shadow_texel(vec4 block, vec2 at, float column, float row, float depth)
{
    vec2 uv = block.xy + (vec2(column, row) + 0.5 + 0.5 * at) * block.z * vec2(1.0, shadow_aspect);
    return textureLod(shadow_atlas, vec3(uv, depth - DEPTH_ROUNDING), 0.0);
}

#if defined(SHADOW_CUBE)
// d: from the sample point to the surface, m. sampled: its number.
float shadow_tile(vec3 d, vec3 n, ShadowLight light, vec4 rows[2], float near, vec2 tile,
                  float rounding)
{
    vec3 a = abs(d), m = abs(n);
    bool is_x = a.x >= max(a.y, a.z), is_y = !is_x && a.y >= a.z;
    float major = is_x ? d.x : is_y ? d.y : d.z;
    vec3 axis = is_x ? vec3(1.0, 0.0, 0.0) : is_y ? vec3(0.0, 1.0, 0.0) : vec3(0.0, 0.0, 1.0);
    axis = major < 0.0 ? -axis : axis;
    // The filter reads a texel to either side: as much as the surface rises there. A point that
    // this lifts out of its face stays within its border.
    float slope = m.x + m.y + m.z - abs(dot(n, axis));
    d += n * (abs(major) * rows[1].z * (LIFT + slope) + rounding);
    float w = max(dot(d, axis), 1e-9);
    vec2 across = is_x ? d.yz : is_y ? d.xz : d.xy;
    int face = (is_x ? 0 : is_y ? 6 : 12) + (major < 0.0 ? 3 : 0);
    int slot = (int(rows[1].x) >> face) & 7;
    float seen = shadow_texel(rows[0], across * (rows[1].y / w), tile.x * rows[1].w + float(slot),
                              tile.y, 1.0 - near / w);
    return slot == 7 ? 1.0 : seen;
}
#elif defined(SHADOW_SPOT)
float shadow_tile(vec3 d, vec3 n, ShadowLight light, vec4 rows[2], float near, vec2 tile,
                  float rounding)
{
    float na = dot(n, light.axis);
    // sqrt(2) of the sine is at least what the corners of the filter rise by.
    float slope = sqrt(max(2.0 - 2.0 * na * na, 0.0));
    d += n * (max(dot(d, light.axis), 0.0) * rows[1].w * (LIFT + slope) + rounding);
    float w = max(dot(d, light.axis), 1e-9);
    vec2 at = vec2(dot(d, rows[1].xyz), dot(d, cross(light.axis, rows[1].xyz))) / w;
    return shadow_texel(rows[0], at, tile.x, tile.y, 1.0 - near / w);
}
#elif defined(SHADOW_ORTHO)
// p: relative to the eye. shear: m across for each m along.
float shadow_tile(vec3 p, vec3 n, ShadowLight light, vec4 rows[6], vec2 shear, vec2 tile,
                  float rounding)
{
    vec3 a = -light.place, u = rows[0].xyz, v = cross(a, u);
    float na = dot(n, a), slope = sqrt(max(2.0 - 2.0 * na * na, 0.0));
    // The finest map that holds the point.
    vec2 across = vec2(dot(p, u), dot(p, v)) + dot(p, a) * shear;
    vec4 map = rows[5];
    for (int i = 4; i >= 2; --i) {
        vec2 at = abs(across - rows[i].xy) * rows[i].z;
        map = max(at.x, at.y) < 0.97 ? rows[i] : map;
    }
    float texels = rows[1].z * float(textureSize(shadow_atlas, 0).x);
    p += n * (2.0 / (map.z * texels) * (LIFT + slope) + rounding);
    float z = dot(p, a);
    vec2 at = (vec2(dot(p, u), dot(p, v)) + z * shear - map.xy) * map.z;
    float maps = rows[5].w + 1.0;
    float seen = shadow_texel(vec4(rows[1].xyz, 0.0), at, tile.x * maps + map.w, tile.y,
                              (z - rows[1].w) * rows[0].w);
    return max(abs(at.x), abs(at.y)) < 0.99 ? seen : 1.0;
}
#endif

// p: surface point (m, relative to the eye); n: its unit normal, on the lit side; plane: that of
// the surface without its bumps, by which p is lifted off it.
float visibility(vec3 p, vec3 n, vec3 plane, ShadowLight light, vec4 rows[SHADOW_ROWS])
{
    // G-buffer and light are float32 relative to the eye.
    float rounding = shadow_rounding + 1e-6 * sqrt(dot(p, p));
#if !defined(SHADOW_AREA)
#if defined(SHADOW_ORTHO)
    return shadow_tile(p, plane, light, rows, vec2(0.0), vec2(0.0), rounding);
#else
    return shadow_tile(p - light.place, plane, light, rows, rows[0].w, vec2(0.0), rounding);
#endif
#else
    float seen = 0.0, all = 0.0;
    const int across = SAMPLES / SAMPLE_ROWS;
#if defined(SHADOW_BALL)
    mat3 frame = mat3(light.radius);
#elif defined(SHADOW_TUBE)
    mat3 frame = mat3(light.x, light.radius * light.axis,
                      light.radius * cross(normalize(light.x), light.axis));
    vec3 along = normalize(light.x);
#else
    mat3 frame = mat3(light.x, light.y, vec3(0.0));
#endif
    for (int k = 0; k < SAMPLES; ++k) {
        vec4 point = shadow_samples[k];
        vec2 tile = vec2(k % across, k / across);
#if defined(SHADOW_SUN)
        float weight = 1.0;
        vec2 shear = point.xy * light.radius;
        float lit = shadow_tile(p, plane, light, rows, shear, tile, rounding);
#else
        // What the point gives: cos at the surface, cos at the light, 1 / d^2.
        vec3 d = p - light.place - frame * point.xyz;
        float d2 = max(dot(d, d), 1e-20), weight = max(-dot(d, n), 0.0) / (d2 * sqrt(d2));
#if defined(SHADOW_RECT) || defined(SHADOW_DISK)
        weight *= max(dot(d, light.axis), 0.0) * inversesqrt(d2);
#elif defined(SHADOW_TUBE)
        weight *= sqrt(max(1.0 - dot(d, along) * dot(d, along) / d2, 0.0));
#endif
#if defined(SHADOW_SPOT)
        // A point outside the tile is outside the cone too.
        float w = max(dot(d, light.axis), 1e-9);
        vec2 at = vec2(dot(d, rows[1].xyz), dot(d, cross(light.axis, rows[1].xyz)));
        weight = max(abs(at.x), abs(at.y)) < w ? weight : 0.0;
#endif
        float lit = shadow_tile(d, plane, light, rows, max(rows[0].w, light.radius * point.w),
                                tile, rounding);
#endif
        seen += weight * lit;
        all += weight;
    }
    return all > 0.0 ? seen / all : 1.0;
#endif
}
