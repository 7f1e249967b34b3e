/* The volume network against a plain twin in double, its reader, and which scans it is for. */
#include "config.h"
#include "core/par.h"
#include "core/vol.h"
#include "numbers.h"
#include "inverse/upsample.h"
#include "restore/restore.h"
#include "restore/volume-network.h"
#include "slice-network-make.h"
#include "volume-network-plain.h"

#include <stdbool.h>
#include <string.h>

enum { WIDTH = 6, BLOCKS = 2 };

static const struct ct_regime regime = {0.3, 12, CT_DECIMATE_POINT};

/* Tensors of a small network, each of random values from a stream of its own. */
static void put_network(struct ct_tensors *w, size_t width, size_t blocks)
{
	const float shape[4] = {4, (float)width, (float)blocks, 2};
	const struct {
		const char *name;
		size_t dim[2];
		double scale;
	} all[] = {{"first", {width, 128 * 27}, 5e-4}, {"one", {blocks * width, width * 27}, 0.1},
		{"second", {blocks * width, width * 27}, 0.05},
		{"second_bias", {blocks, width}, 0.1}, {"last", {64, width * 27}, 0.5},
		{"last_bias", {1, 64}, 0.5}, {"regime", {(1 + blocks) * width, 9}, 0.1}};
	char name[64];

	must(ct_tensors_put(w, "volume-4.shape", 1, (size_t[]){4}, shape, &err));
	for (size_t k = 0; k < sizeof all / sizeof *all; k++) {
		struct ct_tensor *t;

		snprintf(name, sizeof name, "volume-4.%s", all[k].name);
		must(ct_tensors_add(w, name, 2, all[k].dim, &t, &err));
		ct_rng_normals(ct_tensor_count(t), t->data, 71, k, 0);
		for (size_t i = 0; i < ct_tensor_count(t); i++)
			t->data[i] *= (float)all[k].scale;
	}
}

/* Values of a CT, and what was added to it, h after them. */
static float *volumes(size_t count)
{
	float *x = normals(3 * count, 72, 0, 300);

	for (size_t i = count; i < 2 * count; i++)
		x[i] /= 10;
	return x;
}

static void sizes(const struct ct_volume_network *r, const struct ct_tensors *w)
{
	static const size_t all[][3] = {
		{4, 4, 4}, {1, 1, 1}, {12, 8, 20}, {13, 10, 7}, {3, 17, 40}, {9, 41, 2}};
	struct ct_env env = {0}, many = {0};

	must(ct_par_alloc(&many.par, 3, &err));
	for (size_t k = 0; k < sizeof all / sizeof *all; k++) {
		const size_t *n = all[k], count = n[0] * n[1] * n[2];
		float *x = volumes(count), *h = x + 2 * count, *want = malloc(count * sizeof *want);

		must(!want);
		volume_network_plain(want, w, x, x + count, n, &regime);
		must(ct_volume_network_predict(r, h, x, x + count, n, &regime, &env, &err));
		OK(apart(count, h, want) < 1e-5,
			"%zu x %zu x %zu voxels are as the twin has them (%g)", n[0], n[1], n[2],
			apart(count, h, want));
		must(ct_volume_network_predict(r, want, x, x + count, n, &regime, &many, &err));
		OK(memcmp(h, want, count * sizeof *h) == 0, "three threads give the same bytes");
		free(x);
		free(want);
	}
	ct_par_free(many.par);
}

/* Beyond 80 cells a volume is cut; this network sees 6 cells far, and a column has 8 more. */
static void columns(const struct ct_volume_network *r, const struct ct_tensors *w)
{
	const size_t n[3] = {4 * 81 + 2, 5, 3}, count = n[0] * n[1] * n[2];
	float *x = volumes(count), *want = malloc(count * sizeof *want);
	struct ct_env env = {0};

	must(!want);
	volume_network_plain(want, w, x, x + count, n, &regime);
	must(ct_volume_network_predict(r, x + 2 * count, x, x + count, n, &regime, &env, &err));
	NEAR(apart(count, x + 2 * count, want), 0, 1e-5, "columns are as the whole is");
	free(x);
	free(want);
}

static void reading(void)
{
	static const struct {
		const char *name, *what;
		size_t at;
		float value;
	} bad[] = {{"shape", "another cell", 0, 3}, {"shape", "no channels", 1, 0},
		{"shape", "too many channels", 1, 513}, {"shape", "a NaN of blocks", 2, NAN},
		{"shape", "too many blocks", 2, 1e9f}, {"shape", "another number of inputs", 3, 1},
		{"shape", "other channels than the tensors", 1, WIDTH + 1},
		{"one", "an infinite weight", 7, INFINITY}, {"regime", "a NaN", 0, NAN}};
	static const char *const names[] = {
		"first", "one", "second", "second_bias", "last", "last_bias", "regime"};
	struct ct_volume_network r = {0};
	struct ct_tensors w = {0};
	char name[64];

	must(ct_volume_network_get(&r, &w, "volume-4", &err));
	OK(r.blocks == 0 && !r.all, "no tensors, no network");
	put_network(&w, WIDTH, BLOCKS);
	for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
		float *value, kept;

		snprintf(name, sizeof name, "volume-4.%s", bad[k].name);
		value = ct_tensors_find(&w, name)->data + bad[k].at;
		kept = *value;
		*value = bad[k].value;
		err = (struct ct_err){0};
		OK(ct_volume_network_get(&r, &w, "volume-4", &err) == -1 && !r.all &&
				strstr(err.msg, k == 6 ? "volume-4.first" : name),
			"%s is refused: %s", bad[k].what, err.msg);
		*value = kept;
	}
	for (size_t k = 0; k < sizeof names / sizeof *names; k++) {
		struct ct_tensor *t;

		snprintf(name, sizeof name, "volume-4.%s", names[k]);
		t = ct_tensors_find(&w, name);
		t->dim[1]--;
		OK(ct_volume_network_get(&r, &w, "volume-4", &err) == -1 && !r.all &&
				strstr(err.msg, name),
			"%s of another shape is refused", names[k]);
		t->dim[1]++;
	}
	ct_tensors_free(&w);
}

/* A pass by the volume network follows where the three axes are coarse, as it was trained. */
static void use(const struct ct_volume_network *r)
{
	static const struct {
		double factor[3];
		int passes;
	} all[] = {{{4, 4, 4}, 2}, {{4.7, 5, 4}, 2}, {{1, 1, 4}, 1}, {{4, 4, 1}, 1},
		{{3.9, 4, 4}, 1}, {{2, 2, 2}, 1}, {{8, 8, 8}, 1}};
	struct ct_slice_prior p = {.n = 2, .volume = *r};

	p.r[0] = (struct ct_slice_network){
		.shape = {4, 8, 1, 1, true}, .components = 9, .width = 13};
	p.r[1] = (struct ct_slice_network){
		.shape = {8, 16, 1, 1, true}, .components = 9, .width = 13};
	for (size_t k = 0; k < sizeof all / sizeof *all; k++) {
		struct ct_degrade d = {.decimate = CT_DECIMATE_MEAN};

		memcpy(d.factor, all[k].factor, sizeof d.factor);
		OK(ct_slice_prior_passes(&p, &d) == all[k].passes, "factors %g,%g,%g: %d passes",
			d.factor[0], d.factor[1], d.factor[2], all[k].passes);
	}
	p.volume.blocks = 0;
	OK(ct_slice_prior_passes(&p, &(struct ct_degrade){.factor = {4, 4, 4}}) == 1,
		"without it one");
}

/* A second pass is the first, what the network makes of it and of what it added, and the settling.
 */
static void restoring(const struct ct_volume_network *r)
{
	enum { ALL = 18 * 16 * 17 };
	const size_t n[3] = {18, 16, 17}, m[3] = {4, 4, 4};
	struct ct_slice_prior p = {.n = 1, .volume = *r};
	struct ct_restore_rule rule = {.by = {.factor = {4, 4, 4},
					       .sigma = {1.2, 1.2, 1.2},
					       .decimate = CT_DECIMATE_POINT},
		.noise = 12,
		.weight = 1,
		.passes = 2,
		.axes = {true, true, true}};
	struct ct_vol lo = {0}, x = {0}, first = {0};
	float *base = normals(2 * ALL, 73, 0, 200), *h = base + ALL;
	struct ct_restore_report report;
	struct ct_env env = {0};
	double residual, added;

	p.r[0] = (struct ct_slice_network){
		.shape = {4, 8, 1, 1, true}, .components = 9, .width = 13};
	random_network(&p.r[0]);
	must(ct_vol_alloc(&lo, m, &err));
	must(ct_vol_alloc(&x, n, &err));
	must(ct_vol_alloc(&first, n, &err));
	ct_rng_normals(4 * 4 * 4, lo.data, 73, 1, 0);
	for (int a = 0; a < 3; a++)
		x.affine[a][a] = first.affine[a][a] = 1;
	ct_degrade_affine(lo.affine, x.affine, n, &rule.by);
	memcpy(x.data, base, ALL * sizeof *base);
	memcpy(first.data, base, ALL * sizeof *base);
	must(ct_restore(&x, NULL, &lo, &p, &rule, &report, &env, &err));
	rule.passes = 1;
	must(ct_restore(&first, NULL, &lo, &p, &rule, &report, &env, &err));
	added = report.added;
	for (size_t i = 0; i < ALL; i++)
		base[i] = first.data[i] - base[i];
	must(ct_volume_network_predict(r, h, first.data, base, n,
		&(struct ct_regime){0.3, 12, CT_DECIMATE_POINT}, &env, &err));
	for (size_t i = 0; i < ALL; i++)
		first.data[i] += h[i];
	must(ct_upsample_settle(&first, &lo, &rule.by, 36, &residual, &env, &err));
	NEAR(apart(ALL, x.data, first.data), 0, 1e-6,
		"a second pass adds what the network expects");
	OK(added > 1 && rms(ALL, h, NULL) > 1, "both passes add (%g, %g HU)", added,
		rms(ALL, h, NULL));
	ct_slice_network_free(&p.r[0]);
	ct_vol_free(&lo);
	ct_vol_free(&x);
	ct_vol_free(&first);
	free(base);
}

int main(void)
{
	struct ct_volume_network r = {0};
	struct ct_tensors w = {0};

	put_network(&w, WIDTH, BLOCKS);
	must(ct_volume_network_get(&r, &w, "volume-4", &err));
	sizes(&r, &w);
	columns(&r, &w);
	reading();
	use(&r);
	restoring(&r);
	ct_volume_network_free(&r);
	ct_tensors_free(&w);
	return tap_done();
}
