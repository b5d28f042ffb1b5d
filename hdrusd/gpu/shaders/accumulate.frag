// One of the frames that a supersampled frame is the mean of; added up by blending.
uniform sampler2D frame;  // cd/m2
uniform float weight;
layout(location = 0) out vec4 sum;

void main()
{
    sum = texelFetch(frame, ivec2(gl_FragCoord.xy), 0) * weight;
}
