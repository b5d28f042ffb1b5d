// One instance is a rectangle of the screen and a batch of lights: its vertices fetch them once.
// A buffer read in every pixel is what costs on a software device, not the arithmetic.
// A batch is FIRST lights of FIRST_ROWS texels and CONED lights (see light.frag) of CONED_ROWS.
in ivec4 in_area;          // left, bottom, right, top, pixels
in ivec4 in_list;          // where the two kinds begin in ``order``, and how many: first, n, first, n
uniform sampler2D lights;  // texels, light after light
uniform isampler2D order;  // where lights begin in it, batch after batch
uniform ivec2 dark;        // where a light begins that is not there, of either kind
uniform vec2 size;         // of the picture, pixels
uniform vec3 ray_origin, ray_x, ray_y;  // the window's corner and sides at distance 1, m
#ifndef ORTHOGRAPHIC
uniform vec3 forward;      // unit vector along the view axis
#endif

flat out vec4 data[FIRST * FIRST_ROWS + CONED * CONED_ROWS];
noperspective out vec2 window;  // 0 to 1 over the picture
noperspective out vec3 ray;     // m, from the eye to what it sees there at distance 1

int light_at(int index)
{
    int width = textureSize(order, 0).x;
    return texelFetch(order, ivec2(index % width, index / width), 0).r;
}

vec4 texel(int index)
{
    int width = textureSize(lights, 0).x;
    return texelFetch(lights, ivec2(index % width, index / width), 0);
}

void main()
{
    window = vec2((gl_VertexID & 1) == 0 ? in_area.x : in_area.z,
                  (gl_VertexID & 2) == 0 ? in_area.y : in_area.w) / size;
    ray = ray_origin + window.x * ray_x + window.y * ray_y;
#ifndef ORTHOGRAPHIC
    ray += forward;
#endif
    gl_Position = vec4(window * 2.0 - 1.0, 1.0, 1.0);  // farthest: only pixels with a surface pass
#if FIRST > 0
    for (int i = 0; i < FIRST; ++i) {
        int light = i < in_list.y ? light_at(in_list.x + i) : dark.x;
        for (int k = 0; k < FIRST_ROWS; ++k)
            data[i * FIRST_ROWS + k] = texel(light + k);
    }
#endif
#if CONED > 0
    for (int i = 0; i < CONED; ++i) {
        int light = i < in_list.w ? light_at(in_list.z + i) : dark.y;
        for (int k = 0; k < CONED_ROWS; ++k)
            data[FIRST * FIRST_ROWS + i * CONED_ROWS + k] = texel(light + k);
    }
#endif
}
