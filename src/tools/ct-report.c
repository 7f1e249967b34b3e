/* ct-report: one page to look at what became of a CT, and at what in it not to trust.
 * SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "cli/cli.h"
#include "formats/format.h"
#include "formats/io.h"
#include "formats/units.h"
#include "tools/page-file.h"

#include <stdlib.h>
#include <string.h>

struct params {
	const char *lr, *hr, *out, *std, *truth, *log;
};

static const struct params defaults = {0};

#define CT_PARAMS struct params
static const struct ct_opt opts[] = {
	CT_ARG(lr, CT_READS, "LR", "the low-resolution CT, NIfTI, or -"),
	CT_ARG(hr, CT_READS, "HR", "what was made of it, NIfTI, or -"),
	CT_ARG_OUT(out, CT_WRITES, "OUT", CT_ENDS_PAGE, "HTML to write, or -"),
	CT_INPUT(std, 0, "uncertainty", "FILE",
		"predicted error of each voxel of HR, HU, from ct-upsample --std or ct-sr --confidence"),
	CT_INPUT(truth, 0, "truth", "FILE",
		"the CT that HR should be, on the same grid: the page shows the error too"),
	CT_INPUT(log, 0, "log", "FILE",
		"text: what the commands that made HR said and took, as CTSR_LOG of ct-pipeline(7) "
		"collects it; its warnings are shown first"),
	CT_OPT_END,
};

struct report_job {
	const struct params *p;
	const struct ct_env *env;
	struct ct_page page;
	unsigned char *log; /* text */
};

static int read_volume(struct ct_page_volume *v, const char *path, bool hu,
	const struct ct_vol *grid, const struct ct_env *env, struct ct_err *e)
{
	if (!path)
		return 0;
	v->name = basename(path);
	if ((hu ? ct_vol_read_hu(path, &v->vol, env, e) : ct_vol_read(path, &v->vol, e)))
		return -1;
	return (hu && ct_meta_need_hu(&v->vol.meta, false, e)) || ct_vol_check_finite(&v->vol, e) ||
			       (grid && ct_vol_same_grid(&v->vol, grid, e))
		       ? ct_blame(e, path)
		       : 0;
}

static int read_all(struct report_job *j, struct ct_err *e)
{
	const struct params *p = j->p;
	struct ct_page *page = &j->page;
	size_t n;

	if ((p->log && ct_slurp(p->log, &j->log, &n, e)) ||
		read_volume(&page->lr, p->lr, true, NULL, j->env, e) ||
		read_volume(&page->hr, p->hr, true, NULL, j->env, e))
		return -1;
	if (j->log && strlen((const char *)j->log) < n)
		return ct_fail(e, CT_EINPUT, "%s: no text: it holds a zero byte", p->log);
	if (j->log)
		ct_page_forget_folders((char *)j->log);
	page->log = (const char *)j->log;
	return ct_err_any(read_volume(&page->std, p->std, false, &page->hr.vol, j->env, e) ||
			  read_volume(&page->truth, p->truth, true, &page->hr.vol, j->env, e));
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	struct report_job j = {.p = params, .env = env};
	int rc = -1;

	if (read_all(&j, e) == 0 && ct_page_measure(&j.page, env, e) == 0)
		rc = page_file_write(j.p->out, &j.page, env, e);
	ct_page_free(&j.page);
	free(j.log);
	return rc;
}

CT_CLI_MAIN("ct-report", "Write a page that shows a refined CT and its warnings.", CT_IN_HU)
