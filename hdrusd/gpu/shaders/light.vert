// One instance is a rectangle of the screen and a batch of lights: its vertices fetch them once.
// A buffer read in every pixel is what costs on a software device, not the arithmetic.
in ivec4 in_area;          // left, bottom, right, top, pixels
in ivec2 in_list;          // where the batch begins in ``order``, and lights in it
uniform sampler2D lights;  // ROWS texels a light, light after light; the last light is dark
uniform isampler2D order;  // numbers of lights, batch after batch
uniform int count;         // lights in all
uniform vec2 size;         // of the picture, pixels

flat out vec4 data[BATCH * ROWS];
out vec2 window;           // 0 to 1 over the picture

ivec2 place(int index, sampler2D image)
{
    int width = textureSize(image, 0).x;
    return ivec2(index % width, index / width);
}

void main()
{
    window = vec2((gl_VertexID & 1) == 0 ? in_area.x : in_area.z,
                  (gl_VertexID & 2) == 0 ? in_area.y : in_area.w) / size;
    gl_Position = vec4(window * 2.0 - 1.0, 1.0, 1.0);  // farthest: only pixels with a surface pass
    int width = textureSize(order, 0).x;
    for (int i = 0; i < BATCH; ++i) {
        int at = in_list.x + i;
        int light = i < in_list.y ? texelFetch(order, ivec2(at % width, at / width), 0).r : count;
        for (int k = 0; k < ROWS; ++k)
            data[i * ROWS + k] = texelFetch(lights, place(light * ROWS + k, lights), 0);
    }
}
