/* page-cards.c: the tables and curves of the page of ct-report; see page.h.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "operator/degrade.h"
#include "estimate/edge-lines.h"
#include "report/page.h"

#include <math.h>
#include <string.h>

/* A line of a curve: part of the width and of the height of the frame, each 0 to 1. */
struct line {
	const char *class, *name;
	size_t n;
	const double *x, *y;
};

enum { WIDTH = 440, HEIGHT = 170, LEFT = 18, TOP = 8, FOOT = 34 };

static double across(double x)
{
	return LEFT + x * (WIDTH - 2 * LEFT);
}

static double down(double y)
{
	return TOP + (1 - fmin(fmax(y, 0), 1)) * (HEIGHT - TOP - FOOT);
}

static void put_line(FILE *f, const struct line *l)
{
	fprintf(f, "<polyline class=\"line-%s\" points=\"", l->class);
	for (size_t i = 0; i < l->n; i++)
		fprintf(f, "%s%.1f,%.1f", i ? " " : "", across(l->x[i]), down(l->y[i]));
	fprintf(f, "\"/>\n");
}

/* Lines in a frame, with marks below it. */
static void put_curve(FILE *f, const char *what, const struct line *l, size_t n, double lo,
	double hi, double mark, const char *unit)
{
	fprintf(f,
		"<svg viewBox=\"0 0 %d %d\" role=\"img\" aria-label=\"%s\">\n<rect class=\"frame\" "
		"x=\"%d\" y=\"%d\" width=\"%d\" height=\"%d\"/>\n",
		WIDTH, HEIGHT, what, LEFT, TOP, WIDTH - 2 * LEFT, HEIGHT - TOP - FOOT);
	for (double at = ceil(lo / mark) * mark; at <= hi; at += mark) {
		const double x = across((at - lo) / (hi - lo));

		fprintf(f,
			"<path class=\"frame\" d=\"M%.1f %dV%d\"/><text x=\"%.1f\" y=\"%d\" "
			"text-anchor=\"middle\">%g</text>\n",
			x, HEIGHT - FOOT, HEIGHT - FOOT + 4, x, HEIGHT - FOOT + 16, at);
	}
	fprintf(f, "<text x=\"%d\" y=\"%d\" text-anchor=\"end\">%s</text>\n", WIDTH - LEFT,
		HEIGHT - 4, unit);
	for (size_t i = 0; i < n; i++) {
		put_line(f, &l[i]);
		fprintf(f, "<text class=\"key-%s\" x=\"%d\" y=\"%d\">%s</text>\n", l[i].class,
			LEFT + 70 * (int)i, HEIGHT - 4, l[i].name);
	}
	fprintf(f, "</svg>\n");
}

static void begin(FILE *f, const char *id, const char *title)
{
	fprintf(f, "<section class=\"card\" id=\"%s\"><h2>%s</h2>\n", id, title);
}

static void end(FILE *f, const char *note)
{
	if (note)
		fprintf(f, "<p class=\"note\">%s</p>\n", note);
	fprintf(f, "</section>\n");
}

/* The head of a table of columns TH, and its end. */
#define TABLE(columns) "<table><thead><tr>" columns "</tr></thead><tbody>\n"
#define TH(name) "<th scope=\"col\">" name "</th>"
#define TABLE_END "</tbody></table>\n"
/* A row of a table: its name, and what printf makes of the rest. */
#define ROW(f, name, ...)                                                                          \
	(fprintf(f, "<tr><th scope=\"row\">%s</th><td>", name),                                    \
		ct_page_write_words(f, __VA_ARGS__), fprintf(f, "</td></tr>\n"))
/* One of a number before and after. */
#define PAIR(f, name, number, before, after)                                                       \
	fprintf(f,                                                                                 \
		"<tr><th scope=\"row\">" name "</th><td>" number "</td><td>" number                \
		"</td></tr>\n",                                                                    \
		before, after)

/* The median edge of the scan along each axis that was refined: what its blur was measured on. A
 * line that is none, as of a dip, is left out. How many there are. */
static size_t put_scan_edges(FILE *f, const struct ct_page *p)
{
	static const char *const class[] = {"after", "before", "ideal"};
	static const char *const name[] = {"along x", "along y", "along z"};
	const double reach = (CT_EDGE_LONG - 1) / 2.;
	double x[CT_EDGE_LONG], y[3][CT_EDGE_LONG];
	struct line lines[3];
	size_t n = 0;

	for (size_t k = 0; k < CT_EDGE_LONG; k++)
		x[k] = (double)k / (CT_EDGE_LONG - 1);
	for (int a = 0; a < 3; a++) {
		if (!ct_edge_lines_is_edge(p->seen[a].edge))
			continue;
		for (size_t k = 0; k < CT_EDGE_LONG; k++)
			y[a][k] = 0.5 + 0.3 * p->seen[a].edge[k];
		lines[n] = (struct line){class[n], name[a], CT_EDGE_LONG, x, y[a]};
		n++;
	}
	if (n)
		put_curve(f, "median edge of the scan", lines, n, -reach, reach, 1,
			"voxels of the scan");
	return n;
}

static void put_scan(FILE *f, const struct ct_page *p)
{
	const double *s = p->by.sigma;
	char noise[CT_NOISE_WORDS];
	const char *assumed = ct_meta_get(&p->hr.vol.meta, CT_META_ASSUMED);
	const char *denoised = ct_meta_get(&p->hr.vol.meta, CT_META_DENOISED);
	const char *range = ct_page_range(p);

	begin(f, "scan", "How the scan was made");
	fprintf(f, "<table><tbody>\n");
	if (p->known) {
		ROW(f, "Factor", "%g \u00d7 %g \u00d7 %g", p->by.factor[0], p->by.factor[1],
			p->by.factor[2]);
		ROW(f, "Blur before sampling, standard deviation",
			"%.3g \u00d7 %.3g \u00d7 %.3g voxels of the result", s[0], s[1], s[2]);
		ROW(f, "Sampling", "%s", CT_WORD(CT_DECIMATE_LIST, p->by.decimate));
		if (p->told || !assumed)
			ROW(f, "Known from", "%s",
				p->told ? "the header of the scan" : "the command line");
		else /* the range is among the warnings */
			ROW(f, "Estimated", "%.*s",
				(int)(range ? range - assumed : (ptrdiff_t)strlen(assumed)),
				assumed);
	} else
		ROW(f, "Operator", "not known");
	if (p->noise > 0)
		ROW(f, "Noise, standard deviation", "%.3g HU", p->noise);
	else if (p->texture.common > 0) {
		ct_noise_words(noise, &p->texture);
		ROW(f, "Noise", "%s", noise);
	} else
		ROW(f, "Noise", "none known");
	if (denoised)
		ROW(f, "Noise in the result", "%s", denoised);
	fputs(TABLE_END, f);
	end(f, put_scan_edges(f, p)
			? "The median edge of the scan along each axis that was refined: "
			  "the wider its rise, the more blur."
			: NULL);
}

static void put_agreement(FILE *f, const struct ct_page *p)
{
	if (!p->known)
		return;
	begin(f, "agreement", "Does it agree with the scan?");
	fprintf(f, "<table><tbody>\n");
	ROW(f, "Residual, RMS", "%.3f HU", p->agrees.rms);
	ROW(f, "Residual, 95 % of voxels below", "%.3f HU", p->agrees.p95);
	ROW(f, "Residual, largest", "%.3f HU", p->agrees.max);
	ROW(f, "Voxels of the scan", "%zu", p->agrees.voxels);
	fputs(TABLE_END, f);
	end(f, "The result, blurred and sampled as the scan was, minus the scan. Near zero, the result "
	       "changes nothing that the scan saw. It does not tell whether the added detail is "
	       "true. Noise is not sharpened: where the scan was blurred, it counts as a residual.");
}

static void put_tissues(FILE *f, const struct ct_page *p)
{
	static const char *const names[CT_PAGE_TISSUES] = {"air, below \u2212950 HU",
		"lung or partly air, to \u2212400 HU", "soft tissue, to 200 HU",
		"bone, above 200 HU"};
	size_t all = 0;

	if (!p->std.name && !p->truth.name)
		return;
	begin(f, "error", "How far it is to be trusted");
	fprintf(f, TABLE(TH("Tissue, by the result") TH("voxels") "%s%s"),
		p->std.name ? TH("predicted error, RMS") TH("voxels above 100 HU") : "",
		p->truth.name ? TH("error, RMS") : "");
	for (int k = 0; k < CT_PAGE_TISSUES; k++)
		all += p->tissue[k].voxels;
	for (int k = 0; k < CT_PAGE_TISSUES; k++) {
		const struct ct_page_class *c = &p->tissue[k];

		if (c->voxels == 0)
			continue;
		fprintf(f, "<tr><th scope=\"row\">%s</th><td>%.1f %%</td>", names[k],
			100 * (double)c->voxels / (double)all);
		if (p->std.name)
			fprintf(f, "<td>%.3g HU</td><td>%.1f %%</td>", c->expected,
				100 * (double)c->poor / (double)c->voxels);
		if (p->truth.name)
			fprintf(f, "<td>%.3g HU</td>", c->actual);
		fprintf(f, "</tr>\n");
	}
	fputs(TABLE_END, f);
	end(f, p->std.name ? "The prior of slices, or a model of what the inversion leaves open, "
			     "predicts the error of each voxel. Both were calibrated on other "
			     "patients; the scan itself may scale it."
			   : NULL);
}

static void put_calibration(FILE *f, const struct ct_page *p)
{
	const struct ct_calibration *c = &p->calibration;

	if (!p->std.name || !p->truth.name)
		return;
	begin(f, "calibration", "Is the predicted error right?");
	fputs(TABLE(TH("Tenth of voxels") TH("predicted") TH("error") TH("within 1")
			      TH("within 2")),
		f);
	for (int k = 0; k <= CT_CALIBRATION_ROWS; k++) {
		const bool last = k == CT_CALIBRATION_ROWS;
		const struct ct_calibration_row *r = last ? &c->all : &c->row[k];
		char name[16] = "all";

		if (r->voxels == 0)
			continue;
		if (!last)
			snprintf(name, sizeof name, "%d", k + 1);
		fprintf(f,
			"<tr><th scope=\"row\">%s</th><td>%.3g HU</td><td>%.3g HU</td><td>%.1f "
			"%%</td><td>%.1f %%</td></tr>\n",
			name, r->expected, r->actual, 100 * r->within[0], 100 * r->within[1]);
	}
	fputs(TABLE_END, f);
	end(f, "By the predicted error, the smallest first; voxels with the same stay together. Of "
	       "normal errors 68.3 and 95.4 % are within one and two of it.");
}

static void put_truth(FILE *f, const struct ct_page *p)
{
	const struct ct_metrics *was = &p->was, *is = &p->is;

	if (!p->truth.name)
		return;
	begin(f, "truth", "Against the truth");
	fputs(TABLE(TH("\u22121024 to 3071 HU") TH("before") TH("after")), f);
	PAIR(f, "PSNR", "%.2f dB", was->psnr, is->psnr);
	if (!isnan(is->ssim[CT_SSIM_R2]))
		PAIR(f, "SSIM", "%.4f", was->ssim[CT_SSIM_R2], is->ssim[CT_SSIM_R2]);
	PAIR(f, "Mean absolute error", "%.4g HU", was->mae, is->mae);
	PAIR(f, "Root mean square error", "%.4g HU", was->rmse, is->rmse);
	fputs(TABLE_END, f);
	end(f, NULL);
}

static void put_edges(FILE *f, const struct ct_page *p)
{
	const struct ct_edges *o = &p->edges;
	const double reach = 0.5 * o->width * CT_EDGE_BINS;
	double x[CT_EDGE_BINS], y[2][CT_EDGE_BINS];
	const struct line lines[] = {{"before", "before", CT_EDGE_BINS, x, y[1]},
		{"after", "after", CT_EDGE_BINS, x, y[0]}};

	if (isnan(o->ref.rise))
		return;
	for (size_t b = 0; b < CT_EDGE_BINS; b++) {
		x[b] = ((double)b + 0.5) / CT_EDGE_BINS;
		for (int k = 0; k < 2; k++)
			y[k][b] = 0.1 + 0.8 * o->spread[k][b]; /* room for what overshoots */
	}
	begin(f, "edges", "How sharp edges are");
	put_curve(f, "mean profile of edges", lines, 2, -reach, reach, reach > 10 ? 5 : 2,
		"mm from the edge");
	fprintf(f, TABLE(TH("%zu edges of 300 HU or more") TH("before") TH("after")), o->count);
	if (!isnan(o->test.rise))
		PAIR(f, "10 to 90 %% of the step", "%.2f mm", o->test.rise, o->ref.rise);
	if (!isnan(o->test.mtf10) && !isnan(o->ref.mtf10))
		PAIR(f, "MTF falls to 10 %%", "%.3f /mm", o->test.mtf10, o->ref.mtf10);
	fputs(TABLE_END, f);
	end(f, "The mean profile across the edges of the result, and before at the same places.");
}

static void put_histogram(FILE *f, const struct ct_page *p)
{
	double x[CT_PAGE_BINS], y[2][CT_PAGE_BINS], most = 0;
	const struct line lines[] = {{"before", "before", CT_PAGE_BINS, x, y[0]},
		{"after", "after", CT_PAGE_BINS, x, y[1]}};

	for (size_t b = 0; b < CT_PAGE_BINS; b++)
		for (int k = 0; k < 2; k++) {
			x[b] = ((double)b + 0.5) / CT_PAGE_BINS;
			y[k][b] = log10(1 + (double)p->histogram[k][b]);
			most = fmax(most, y[k][b]);
		}
	for (size_t b = 0; b < CT_PAGE_BINS; b++)
		for (int k = 0; k < 2; k++)
			y[k][b] /= most;
	begin(f, "histogram", "What values there are");
	put_curve(f, "histogram", lines, 2, CT_PAGE_LOWEST,
		CT_PAGE_LOWEST + CT_PAGE_BIN * CT_PAGE_BINS, 500, "HU");
	end(f, "Number of voxels in bins of 32 HU, on a logarithmic scale. The first and the last bin hold "
	       "all values beyond.");
}

void ct_page_write_cards(FILE *f, const struct ct_page *p)
{
	put_agreement(f, p);
	put_tissues(f, p);
	put_truth(f, p);
	put_calibration(f, p);
	put_scan(f, p);
	put_edges(f, p);
	put_histogram(f, p);
}
