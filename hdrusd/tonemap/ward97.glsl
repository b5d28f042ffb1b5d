// Ward Larson, Rushmeier, Piatko, IEEE TVCG 3(4), 1997: one curve; twin of tonemap/ward97.py
#include "tonemap/curve.glsl"

#define PLAIN_CURVE  // it is curve() and no more

// cd/m2 to display-linear [0, 1].
vec3 ward97(vec3 rgb)
{
    return curve(rgb);
}
