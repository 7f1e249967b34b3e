/* gen VOL.nii FIRST COUNT OUT: training pairs as int16: 8 base, 16 rest */
#include "config.h"
#include "restore/example.h"
#include "core/meta.h"
#include "formats/format.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
static short q(float v, float s){ float t=roundf(v*s); return t>32767?32767:t<-32768?-32768:(short)t; }
int main(int c, char **v)
{
	struct ct_vol vol = {0};
	struct ct_err e = {0};
	struct ct_example_rule r = {.side = 96, .factor = 4, .scale = {1.1, 2.3}, .noise = 30, .clip = {-512, 3071}, .seed = 1};
	struct ct_env env = {0};
	unsigned long long h = 1469598103934665603ull;
	if (c > 5) r.side = atoi(v[5]);
	if (c > 6) r.thick = atoi(v[6]);
	if (c > 7) r.factor = atoi(v[7]);
	if (ct_vol_read(v[1], &vol, &e)) { fprintf(stderr, "%s: %s\n", v[1], e.msg); return 1; }
	if (strstr(v[1], "mouse"))
		for (size_t i = 0; i < ct_vol_count(&vol); i++)
			vol.data[i] = vol.data[i] / 255 * 3570 - 1000;
	const char *b = strrchr(v[1], '/'); b = b ? b + 1 : v[1];
	for (const char *p = b; *p; p++) h = (h ^ (unsigned char)*p) * 1099511628211ull;
	ct_example_soft(r.soft, &vol);
	for (int i = atoi(v[2]); i < atoi(v[2]) + atoi(v[3]); i++) {
		struct ct_example p = {0};
		int rc = ct_example_alloc(&p, &vol, &r, (h >> 40 << 20) + i, &env, &e);
		char name[999], tmp[999];
		if (rc < 0) { fprintf(stderr, "%s: %s\n", v[1], e.msg); continue; }
		if (rc) continue;
		snprintf(name, sizeof name, "%s/%s-%d.bin", v[4], b, i);
		snprintf(tmp, sizeof tmp, "%s.part", name);
		FILE *f = fopen(tmp, "wb");
		int n[6] = {p.n[0], p.n[1], p.n[2], p.regime.decimate, (p.coarse[0] > 0) + 2 * (p.coarse[1] > 0) + 4 * (p.coarse[2] > 0), 0};
		float g[4] = {p.regime.sigma, p.regime.noise, sqrt(p.variance), 0};
		size_t m = p.n[0] * p.n[1] * p.n[2];
		short *o = malloc(2 * m * sizeof *o);
		for (size_t k = 0; k < m; k++) { o[k] = q(p.base[k], 8); o[m + k] = q(p.rest[k], 16); }
		fwrite(n, sizeof n, 1, f); fwrite(g, sizeof g, 1, f); fwrite(o, 2, 2 * m, f);
		fclose(f); rename(tmp, name); free(o); ct_example_free(&p);
	}
	return 0;
}
