/* vec3.h: vectors of space. */
#ifndef CT_CORE_VEC3_H
#define CT_CORE_VEC3_H

static inline double ct_vec3_dot(const double a[static 3], const double b[static 3])
{
	return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* out is neither a nor b. */
static inline void ct_vec3_cross(
	double out[static 3], const double a[static 3], const double b[static 3])
{
	out[0] = a[1] * b[2] - a[2] * b[1];
	out[1] = a[2] * b[0] - a[0] * b[2];
	out[2] = a[0] * b[1] - a[1] * b[0];
}

#endif
