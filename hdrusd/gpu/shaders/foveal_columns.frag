// Foveal samples from sums along the rows: their means, top row first; see gpu/foveal.py.

uniform sampler2D sums;            // along rows, cd/m2: foveal samples across, pixels down
uniform int width, height;         // pixels of the frame
uniform int samples_x, samples_y;  // foveal samples
uniform int top_row, row_step;     // row at the top of the picture, and +1 or -1

layout(location = 0) out vec4 mean;

// First pixel of a sample; as eye/foveal.py borders().
int border(int i, int pixels, int samples)
{
    return (2 * i * pixels + samples) / (2 * samples);
}

void main()
{
    ivec2 at = ivec2(gl_FragCoord.xy);
    int begin = border(at.y, height, samples_y), end = border(at.y + 1, height, samples_y);
    vec3 total = vec3(0.0);
    for (int y = begin; y < end; ++y) {
        total += texelFetch(sums, ivec2(at.x, top_row + row_step * y), 0).rgb;
    }
    int across = border(at.x + 1, width, samples_x) - border(at.x, width, samples_x);
    mean = vec4(total / float(across * (end - begin)), 1.0);
}
