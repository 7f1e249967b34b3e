/* ct-info: what is in any of our files. */
#include "config.h"
#include "cli/cli.h"
#include "formats/any.h"
#include "tools/report.h"

#include <stdio.h>

struct params {
	struct ct_list files;
};

static const struct params defaults = {0};

static const struct ct_opt opts[] = {
	CT_ARG(struct params, files, "FILE", "NIfTI, EXR, PLY or safetensors, or -"),
	CT_OPT_END,
};

static int report(const char *path, bool first, const struct ct_env *env, struct ct_err *e)
{
	struct ct_any a = {0};
	json_t *o = NULL;

	if (ct_any_read(path, &a, e) == 0)
		o = ct_report_make(&a, path, env->verbose > 0, e);
	if (o && env->json) {
		json_dumpf(o, stdout, JSON_INDENT(2) | JSON_REAL_PRECISION(15));
		putchar('\n'); /* ct_cli_main checks standard output */
	} else if (o) {
		if (!first)
			putchar('\n');
		ct_report_print(stdout, o);
	}
	ct_any_free(&a);
	json_decref(o);
	return o ? 0 : -1;
}

static int run(const void *params, const struct ct_env *env, struct ct_err *e)
{
	const struct params *p = params;

	for (size_t i = 0; i < p->files.n; i++)
		if (report(p->files.v[i], i == 0, env, e))
			return -1;
	return 0;
}

static const struct ct_tool tool = {
	.name = "ct-info",
	.brief = "Print size, geometry, range and history of our files.",
	.opts = opts,
	.defaults = &defaults,
	.size = sizeof defaults,
	.run = run,
	.flags = CT_REPORTS,
};

int main(int argc, char **argv)
{
	return ct_cli_main(&tool, argc, argv);
}
