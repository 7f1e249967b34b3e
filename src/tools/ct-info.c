/* ct-info: what is in any of our files. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/cli.h"
#include "cli/json.h"
#include "core/vec3.h"
#include "formats/any.h"
#include "formats/beside.h"
#include "formats/ends.h"
#include "estimate/noise.h"
#include "operator/padding.h"
#include "estimate/assumed.h"
#include "tools/lib/said.h"
#include "tools/scan-read.h"
#include "dicom/form.h"
#include "estimate/frame.h"
#include "report/report.h"

#include <stdio.h>
#include <strings.h>

enum { DIGITS = 15 };

struct params {
	struct ct_list files;
	const char *factor, *series;
	bool measures;
};

static const struct params defaults = {0};

#define CT_PARAMS struct params
static const struct ct_opt opts[] = {
	CT_ARG(files, CT_READS, "FILE",
		"NIfTI, MetaImage, NRRD, EXR, PLY, safetensors or PyTorch, DICOM (folder, archive or file), or -"),
	CT_TEXT(series, 0, "series", "UID|N",
		"of DICOM: the series that -e measures, or that decides the exit status"),
	CT_FLAG(measures, 'e', "operator",
		"estimate blur, sampling and noise of each CT, whatever ct-degrade says in its header"),
	CT_TEXT(factor, 'x', "factor", "S|X,Y,Z",
		"how many times finer the grid is that the blur is wanted for; default: as ct-sr",
		CT_WHEN(CT_IF(measures))),
	CT_OPT_END,
};

static int put_padding(json_t *o, const struct ct_vol *v, struct ct_err *e)
{
	struct ct_padding p;
	int bad = 0;

	if (ct_padding_find(&p, v->data, v->n, e))
		return -1;
	if (p.is) {
		const double share = (double)p.count / (double)ct_vol_count(v);

		bad = json_object_set_new(o, "padding-share", json_real(share)) ||
		      json_object_set_new(o, "padding-hu", json_real(p.hu));
	}
	ct_padding_free(&p);
	return bad ? ct_fail(e, CT_ENOMEM, "no memory for the report") : 0;
}

static int estimate(json_t *o, const struct ct_any *a, const char *path, const struct ct_said *said,
	const struct ct_env *env, struct ct_err *e)
{
	const char *quantity = ct_meta_get(ct_any_meta(a), CT_META_QUANTITY);
	char assumed[CT_ASSUMED_WORDS];
	struct ct_vol bare = a->vol, own = {0};
	const struct ct_frame frame = ct_frame_of(&a->vol);
	const struct ct_vol *use;
	struct ct_said turned = *said;
	struct ct_operator is;
	struct ct_noise noise;
	double mm[3];
	int rc = 0;

	if (a->kind != CT_KIND_VOLUME || (quantity && strcasecmp(quantity, CT_QUANTITY_HU) != 0))
		return ct_fail(e, CT_EINPUT, "%s: -e wants a CT in HU", path);
	bare.meta = (struct ct_meta){0};
	ct_frame_said(&turned, frame.axis);
	if (ct_acquired_copy(&bare.meta, &a->vol.meta, e) ||
		ct_frame_enter(&own, &use, &frame, &bare, env->par, e) ||
		ct_operator_find(&is, &turned, false, use, env, e) ||
		ct_noise_measure(&noise, use, e) || put_padding(o, use, e))
		rc = ct_blame(e, path);
	ct_vol_free(&own);
	ct_meta_free(&bare.meta);
	if (rc)
		return rc;
	ct_frame_operator(&is, frame.back);
	ct_vec3_order(noise.alike, sizeof *noise.alike, frame.back);
	ct_vol_spacing(&bare, mm);
	ct_assumed_words(assumed, &is, mm);
	return ct_report_estimate(
		o, &(struct ct_report_operator){assumed, is.seen, is.told, is.joint, &noise}, e);
}

/* Any of our files. What is measured may be DICOM, and may have a sidecar. */
static int read_any(struct ct_any *a, const struct params *p, const char *path,
	const struct ct_env *env, struct ct_err *e)
{
	if (p->measures && dicom_form_of(path) != NOT_DICOM) {
		a->kind = CT_KIND_VOLUME;
		return scan_read(&a->vol, path, p->series, NULL, NULL, env, e);
	}
	if (ct_any_read(path, a, e))
		return -1;
	return p->measures && a->kind == CT_KIND_VOLUME ? ct_beside_read(&a->vol, path, env, e) : 0;
}

/* `into` is the array of all files, or NULL if they are text or there is but one. */
static int report(const struct params *p, const char *path, bool first, json_t *into,
	const struct ct_env *env, struct ct_err *e)
{
	const struct ct_dicom_in in = {.paths = &path, .n = 1, .series = p->series};
	const enum dicom_form form = dicom_form_of(path);
	struct ct_any a = {0};
	json_t *o = NULL;
	struct said_opts says = SAID_DEFAULTS;
	struct ct_said said;
	int rc;

	says.factor = p->factor;
	if (said_parse(&said, &says, e))
		return -1;
	if (p->series && form == NOT_DICOM)
		return ct_fail(e, CT_EUSAGE, "--series: %s is not DICOM", path);
	said.estimate = true;
	if (!first && !env->command->json)
		putchar('\n');
	if (!p->measures && (form == FOLDER || form == FILE_OF_SERIES))
		return ct_dicom_inspect(&in, into, env, e);
	if (read_any(&a, p, path, env, e) == 0)
		o = ct_report_make(&a, path, env->verbose > 0, e);
	else if (!p->measures && form == ARCHIVE && !ct_ends_match(path, CT_ENDS_TORCH)) {
		*e = (struct ct_err){0};
		return ct_dicom_inspect(&in, into, env, e);
	}
	if (o && p->measures && estimate(o, &a, path, &said, env, e)) {
		json_decref(o);
		o = NULL;
	}
	rc = o ? 0 : -1;
	if (o && into)
		json_array_append(into, o);
	else if (o && env->command->json)
		rc = ct_json_print(o, DIGITS, e);
	else if (o)
		ct_report_print(stdout, o);
	ct_any_free(&a);
	json_decref(o);
	return rc;
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	const struct params *p = params;
	json_t *all = env->command->json && p->files.n > 1 ? json_array() : NULL;
	struct ct_err other;
	int rc = 0;

	for (size_t i = 0; rc == 0 && i < p->files.n; i++)
		rc = report(p, p->files.v[i], i == 0, all, env, e);
	if (all && ct_json_print(all, DIGITS, rc ? &other : e))
		rc = -1;
	json_decref(all);
	return rc;
}

CT_CLI_MAIN("ct-info", "Print size, geometry, range and history of our files.", CT_REPORTS)
