/* sr-scale.c: by how much ct-sr refines; see sr.h. */
#include "config.h"
#include "cli/cli.h"
#include "resolution/degrade.h"
#include "tools/sr.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#define PLAIN 4.0 /* where nothing says a factor */

/* What the header of a volume says, as -x takes it: 0; 1 if it says nothing, or cannot be read. */
static int of_header(char said[static SR_SCALE], const char *path)
{
	struct ct_vol head = {0};
	struct ct_degrade d;
	struct ct_err why;
	struct stat st;
	int rc = 1;

	if (stat(path, &st) == 0 && S_ISREG(st.st_mode) && sr_head(&head, path, &why) == 0 &&
		!ct_meta_get(&head.meta, CT_META_UPSAMPLE))
		rc = ct_degrade_get(&head.meta, &d, &why) == 0 ? 0 : 1;
	if (rc == 0 && d.factor[0] == d.factor[1] && d.factor[0] == d.factor[2])
		snprintf(said, SR_SCALE, "%.9g", d.factor[0]);
	else if (rc == 0)
		snprintf(said, SR_SCALE, "%.9g,%.9g,%.9g", d.factor[0], d.factor[1], d.factor[2]);
	ct_vol_free(&head);
	return rc;
}

void sr_scale_find(struct sr *p)
{
	if (p->factor || p->spacing)
		return;
	p->assumed = of_header(p->said, p->in) != 0;
	if (p->assumed)
		snprintf(p->said, sizeof p->said, "%g", PLAIN);
	p->factor = p->said;
}

int sr_scale_check(double x[static 3], const struct sr *p, struct ct_err *e)
{
	int rc = ct_cli_numbers("scale", p->factor, ',', 3, true, x, e);

	for (int a = 0; rc == 0 && a < 3; a++)
		if (!(x[a] >= 1 && x[a] <= 16))
			rc = ct_fail(e, CT_EUSAGE, "--scale: %g is outside [1, 16]", x[a]);
	if (rc == 0 && x[0] == 1 && x[1] == 1 && x[2] == 1)
		rc = ct_fail(e, CT_EUSAGE, "--scale: 1 refines nothing");
	return rc && p->factor == p->said ? ct_blame(e, p->in) : rc;
}

int sr_scale_settle(struct ct_chain *c, struct sr *p, struct ct_err *e)
{
	struct ct_step *s = &c->step[1];
	char was[SR_SCALE];
	double x[3];

	memcpy(was, p->said, sizeof was);
	if (!p->assumed || of_header(p->said, c->step[0].output) || strcmp(was, p->said) == 0)
		return 0;
	if (sr_scale_check(x, p, e))
		return -1;
	if (p->projections || sr_published(p))
		return ct_fail(e, CT_EUSAGE,
			"%s: was reduced %s times: projections need -x where the header of IN "
			"can be read only once",
			p->in, p->said);
	for (size_t k = 1; k < s->argc; k++) {
		if (strncmp(s->argv[k], "-x", 2) != 0 || strcmp(s->argv[k] + 2, was) != 0)
			continue;
		free(s->argv[k]);
		if (asprintf(&s->argv[k], "-x%s", p->said) < 0) {
			s->argv[k] = NULL;
			return ct_fail(e, CT_ENOMEM, "no memory");
		}
	}
	return 0;
}
