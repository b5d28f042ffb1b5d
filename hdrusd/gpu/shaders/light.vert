// One instance is one batch of lights: its vertices fetch them once for the whole screen.
// A buffer read in every pixel is what costs on a software device, not the arithmetic.
uniform sampler2D lights;  // a row a light: ROWS texels of 4 floats
uniform int first;         // index of the first light
uniform int count;         // lights in all

flat out vec4 data[BATCH * ROWS];

void main()
{
    vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
    gl_Position = vec4(corner, 1.0, 1.0);  // farthest depth: only pixels with a surface pass
    for (int i = 0; i < BATCH; ++i) {
        int light = first + gl_InstanceID * BATCH + i;
        for (int k = 0; k < ROWS; ++k)  // a light that is not there is dark, at a safe place
            data[i * ROWS + k] = light < first + count ? texelFetch(lights, ivec2(k, light), 0)
                                 : k == 0 ? vec4(0.0, 0.0, 1.0, 0.0) : vec4(0.0, 0.0, 0.0, 1.0);
    }
}
