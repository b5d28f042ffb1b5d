// One instance is one batch of lights: its vertices fetch them once for the whole screen.
// A buffer read in every pixel is what costs on a software device, not the arithmetic.
uniform sampler2D lights;  // a row a light: ROWS texels of 4 floats, the last row dark
uniform int first;         // the light that this draw begins with
uniform int count;         // lights in all

flat out vec4 data[BATCH * ROWS];
out vec2 window;           // 0 to 1 over the picture

void main()
{
    vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
    window = corner * 0.5 + 0.5;
    gl_Position = vec4(corner, 1.0, 1.0);  // farthest depth: only pixels with a surface pass
    for (int i = 0; i < BATCH; ++i)
        for (int k = 0; k < ROWS; ++k)
            data[i * ROWS + k] = texelFetch(lights, ivec2(k, min(first + gl_InstanceID * BATCH + i, count)), 0);
}
