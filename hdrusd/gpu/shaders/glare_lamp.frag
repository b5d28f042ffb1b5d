// See glare_lamp.vert, glare_taken.vert.
in vec3 light;
layout(location = 0) out vec4 level;

void main()
{
    level = vec4(light, 0.0);
}
