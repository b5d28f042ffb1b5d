// See glare_lamp.vert.
in vec3 luminance;
layout(location = 0) out vec4 level;

void main()
{
    level = vec4(luminance, 0.0);
}
