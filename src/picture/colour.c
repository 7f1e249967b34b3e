/* colour.c: see montage.h. */
#include "config.h"
#include "picture/montage.h"

#include <math.h>
#include <string.h>

static const unsigned char inferno[][3] = {{0, 0, 4}, {40, 11, 84}, {101, 21, 110}, {159, 42, 99},
	{212, 72, 66}, {245, 125, 21}, {250, 193, 39}, {252, 255, 164}},
			   diverging[][3] = {{59, 76, 192}, {98, 130, 234}, {141, 176, 254},
				   {184, 208, 249}, {221, 221, 221}, {245, 196, 173},
				   {244, 154, 123}, {222, 96, 77}, {180, 4, 38}};

static unsigned char byte(double x)
{
	return (unsigned char)(x > 0 ? x < 255 ? rint(x) : 255 : 0);
}

/* Between n evenly spaced places. */
static void between(unsigned char rgb[3], double t, const unsigned char (*place)[3], int n)
{
	const double at = fmin(fmax(t, 0), 1) * (n - 1);
	const int k = at < n - 1 ? (int)at : n - 2;

	for (int c = 0; c < 3; c++)
		rgb[c] = byte(place[k][c] + (at - k) * (place[k + 1][c] - place[k][c]));
}

void ct_colour_map_of(unsigned char rgb[static 3], double t, enum ct_colour_map map)
{
	if (isnan(t)) {
		memcpy(rgb, (unsigned char[3]){0, 0, 255}, 3);
		return;
	}
	switch (map) {
	case CT_COLOUR_INFERNO:
		between(rgb, t, inferno, (int)(sizeof inferno / sizeof *inferno));
		return;
	case CT_COLOUR_SIGNED:
		between(rgb, t, diverging, (int)(sizeof diverging / sizeof *diverging));
		return;
	case CT_COLOUR_HOT:
	case CT_COLOUR_GREY:
		for (int c = 0; c < 3; c++)
			rgb[c] = byte(255 * (map == CT_COLOUR_HOT ? 3 * t - c : t));
	}
}
