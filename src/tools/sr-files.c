/* sr-files.c: the files of ct-sr; see sr.h. */
#include "config.h"
#include "cli/files.h"
#include "diffusion/residual.h"
#include "formats/format.h"
#include "formats/io.h"
#include "formats/out-folder.h"
#include "restore/restore.h"
#include "tools/convert.h"
#include "tools/dicom-form.h"
#include "tools/prior-file.h"
#include "tools/sr.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A name that no command takes for an option; NULL if no memory. */
static char *plain(const char *name)
{
	char *s = NULL;

	return asprintf(&s, "%s%s", name[0] == '-' && name[1] ? "./" : "", name) < 0 ? NULL : s;
}

/* A prior of slices, before the time is spent that comes before it. */
static int check_slices(const char *path, struct ct_err *e)
{
	struct ct_slice_prior prior = {0};
	struct ct_tensors w = {0};
	int rc = ct_tensors_read(path, &w, e);

	if (rc == 0 && ct_slice_prior_alloc(&prior, &w, e))
		rc = ct_blame(e, path);
	ct_slice_prior_free(&prior);
	ct_tensors_free(&w);
	return rc;
}

/* NULL in f->prior if what projections lack is not known of the factor: there are none then. */
static int know_lack(struct sr_files *f, int scale, const struct ct_env *env, struct ct_err *e)
{
	struct ct_residual prior;
	struct ct_tensors w = {0};
	int rc = ct_tensors_read(f->prior, &w, e);

	if (rc == 0) {
		rc = ct_residual_get(&prior, &w.meta, e);
		if (rc > 0)
			ct_fail(e, CT_EUSAGE, "is not conditional, as --projections wants it");
		if (rc)
			rc = ct_blame(e, f->prior);
	}
	ct_tensors_free(&w);
	if (rc || prior.factor == (size_t)scale)
		return rc;
	ct_log(env, CT_WARN, "%s knows scans %zu times coarser, not %d: there are no projections",
		f->prior, prior.factor, scale);
	free(f->prior);
	f->prior = NULL;
	return 0;
}

/* What DICOM of OUT belongs to, before the time is spent that comes before it. */
static int find_template(struct sr_files *f, const struct sr *p, struct ct_err *e)
{
	const char *from = p->template ? p->template : p->in;
	const bool dicom = dicom_form_of(from) != NOT_DICOM;

	if ((p->template || p->deid) && !ct_files_is_dicom(p->out))
		return ct_fail(e, CT_EUSAGE, "--%s: needs OUT to be DICOM",
			p->template ? "template" : "deid");
	if (p->template && !dicom)
		return ct_fail(e, CT_EINPUT, "%s: is not DICOM", from);
	f->template = dicom ? plain(from) : NULL;
	return dicom && !f->template ? ct_fail(e, CT_ENOMEM, "no memory") : 0;
}

int sr_files_given(struct sr_files *f, const struct sr *p, int scale, const struct ct_env *env,
	struct ct_err *e)
{
	f->in = plain(p->in);
	f->out = plain(p->out);
	f->keep = p->keep ? plain(p->keep) : p->plan ? plain(p->plan) : NULL;
	f->report = p->report ? plain(p->report) : NULL;
	f->confidence = p->confidence ? plain(p->confidence) : NULL;
	if (!f->in || !f->out || ((p->keep || p->plan) && !f->keep) || (p->report && !f->report) ||
		(p->confidence && !f->confidence))
		return ct_fail(e, CT_ENOMEM, "no memory");
	if (find_template(f, p, e))
		return -1;
	if (p->quality != DRAFT && !sr_published(p) &&
		(prior_file_find(&f->slices, p->slices, PRIOR_SLICES, e) ||
			check_slices(f->slices, e)))
		return -1;
	if (scale == 0)
		return 0;
	if (sr_published(p))
		return prior_file_find(&f->prior, p->prior, PRIOR_PICTURES, e);
	return prior_file_find(&f->prior, p->prior, PRIOR_RESIDUAL, e) ||
			       know_lack(f, scale, env, e)
		       ? -1
		       : 0;
}

int sr_files_kept(struct sr_files *f, const struct ct_chain *c, struct ct_err *e)
{
	f->lr = ct_chain_path(c, "lr.nii");
	f->up = ct_chain_path(c, "up.nii");
	f->up_proj = ct_chain_path(c, "up-proj.exr");
	f->lr_proj = ct_chain_path(c, "lr-proj.exr");
	f->sr_proj = ct_chain_path(c, "sr-proj.exr");
	f->res = ct_chain_path(c, "residual.ply");
	f->sr = ct_chain_path(c, "sr.nii");
	f->log = ct_chain_path(c, "log.txt");
	f->result = ct_files_is_dicom(f->out) ? f->sr : f->out;
	return f->lr && f->up && f->up_proj && f->lr_proj && f->sr_proj && f->res && f->sr && f->log
		       ? 0
		       : ct_fail(e, CT_ENOMEM, "no memory");
}

int sr_files_check(const struct sr_files *f, const struct sr *p, struct ct_err *e)
{
	const char *const own[] = {
		f->lr, f->up, f->up_proj, f->lr_proj, f->sr_proj, f->res, f->sr, f->log};
	const char *const outs[] = {p->out, p->report, p->confidence};

	for (size_t i = 0; i < sizeof own / sizeof *own; i++) {
		bool same = ct_out_same(own[i], p->in, true);

		for (size_t k = 0; k < sizeof outs / sizeof *outs; k++)
			same |= outs[k] && ct_out_same(own[i], outs[k], false);
		if (same)
			return ct_fail(e, CT_EOUTPUT, "%s: is written between IN and OUT", own[i]);
	}
	return 0;
}

/* Of a run that goes on: is it its own? */
static int check_beside(const char *path, const char *name, const struct ct_chain *c,
	const struct ct_env *env, struct ct_err *e)
{
	return !path || ct_chain_owns(c, name) ? 0 : ct_out_check(path, env, e);
}

int sr_files_check_out(const struct sr_files *f, const struct sr *p, const struct ct_chain *c,
	const struct ct_env *env, struct ct_err *e)
{
	const bool own = p->resume && ct_chain_owns(c, f->out);
	struct ct_env over = *env;

	over.force |= own;
	if (p->resume && (check_beside(p->report, f->report, c, env, e) ||
				 check_beside(p->confidence, f->confidence, c, env, e)))
		return -1;
	if (ct_out_folder_named(p->out))
		return ct_out_folder_check(p->out, CONVERT_OWN, &over, e);
	return !p->resume || own ? 0 : ct_out_check(p->out, env, e);
}

int sr_files_absolute(struct sr_files *f, struct ct_err *e)
{
	char **const all[] = {&f->template, &f->in, &f->out, &f->keep, &f->prior, &f->slices,
		&f->report, &f->confidence};
	char *here = realpath(".", NULL);
	int rc = here ? 0 : ct_fail(e, CT_EINPUT, ".: %s", strerror(errno));

	for (size_t i = 0; rc == 0 && i < sizeof all / sizeof *all; i++) {
		char *was = *all[i];

		if (!was || was[0] == '/' || strcmp(was, "-") == 0)
			continue;
		if (asprintf(all[i], "%s/%s", here, was) < 0) {
			*all[i] = was;
			rc = ct_fail(e, CT_ENOMEM, "no memory");
		} else
			free(was);
	}
	free(here);
	return rc;
}

void sr_files_free(struct sr_files *f)
{
	free(f->template);
	free(f->in);
	free(f->out);
	free(f->keep);
	free(f->prior);
	free(f->slices);
	free(f->lr);
	free(f->up);
	free(f->up_proj);
	free(f->lr_proj);
	free(f->sr_proj);
	free(f->res);
	free(f->sr);
	free(f->report);
	free(f->confidence);
	free(f->log);
}
