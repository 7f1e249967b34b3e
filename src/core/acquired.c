/* acquired.c: see acquired.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/acquired.h"

#include <stdbool.h>

static const char *const keys[] = {CT_META_DICOM_MAKER, CT_META_DICOM_KERNEL,
	CT_META_DICOM_THICKNESS, CT_META_DICOM_SPACING, CT_META_DICOM_COLLIMATION};

void ct_acquired_text(char to[static CT_ACQUIRED_TEXT], const char *from)
{
	size_t n = 0;

	for (; *from && n + 1 < CT_ACQUIRED_TEXT; from++)
		if (*from >= ' ' && *from <= '~' && (n > 0 || *from != ' '))
			to[n++] = *from;
	while (n > 0 && to[n - 1] == ' ')
		n--;
	to[n] = '\0';
}

static bool is_length(double mm)
{
	return mm >= 0 && mm <= CT_ACQUIRED_WIDEST;
}

const char *ct_acquired_wrong(const struct ct_acquired *a)
{
	int along = 0;

	for (int k = 0; k < 3; k++) {
		if (!is_length(a->thickness[k]))
			return CT_META_DICOM_THICKNESS;
		if (!is_length(a->spacing[k]))
			return CT_META_DICOM_SPACING;
		if (a->spacing[k] > 0 && a->thickness[k] > CT_ACQUIRED_OVERLAP * a->spacing[k])
			return CT_META_DICOM_THICKNESS;
		along += a->thickness[k] > 0;
	}
	return along > 1                    ? CT_META_DICOM_THICKNESS
	       : !is_length(a->collimation) ? CT_META_DICOM_COLLIMATION
					    : NULL;
}

static int put_three(struct ct_meta *m, const char *key, const double x[3], struct ct_err *e)
{
	return ct_meta_setf(m, e, key, "%.6g,%.6g,%.6g", x[0], x[1], x[2]);
}

int ct_acquired_put(struct ct_meta *m, const struct ct_acquired *a, struct ct_err *e)
{
	if ((*a->maker && ct_meta_set(m, CT_META_DICOM_MAKER, a->maker, e)) ||
		(*a->kernel && ct_meta_set(m, CT_META_DICOM_KERNEL, a->kernel, e)) ||
		put_three(m, CT_META_DICOM_THICKNESS, a->thickness, e) ||
		put_three(m, CT_META_DICOM_SPACING, a->spacing, e))
		return -1;
	return a->collimation > 0
		       ? ct_meta_setf(m, e, CT_META_DICOM_COLLIMATION, "%.6g", a->collimation)
		       : 0;
}

int ct_acquired_get(struct ct_acquired *a, const struct ct_meta *m, struct ct_err *e)
{
	const char *maker = ct_meta_get(m, CT_META_DICOM_MAKER);
	const char *kernel = ct_meta_get(m, CT_META_DICOM_KERNEL);
	const char *wrong;
	int rc;

	*a = (struct ct_acquired){0};
	rc = ct_meta_numbers(m, CT_META_DICOM_THICKNESS, 3, a->thickness, e);
	if (rc)
		return rc;
	if (ct_meta_numbers(m, CT_META_DICOM_SPACING, 3, a->spacing, e) < 0 ||
		ct_meta_numbers(m, CT_META_DICOM_COLLIMATION, 1, &a->collimation, e) < 0)
		return -1;
	ct_acquired_text(a->maker, maker ? maker : "");
	ct_acquired_text(a->kernel, kernel ? kernel : "");
	wrong = ct_acquired_wrong(a);
	return wrong ? ct_fail(e, CT_EINPUT,
			       "metadata %s: '%.60s' is not in mm of a CT, or more than %d times the distance of "
			       "its slices",
			       wrong, ct_meta_get(m, wrong), CT_ACQUIRED_OVERLAP)
		     : 0;
}

int ct_acquired_copy(struct ct_meta *to, const struct ct_meta *from, struct ct_err *e)
{
	for (size_t k = 0; k < sizeof keys / sizeof *keys; k++) {
		const char *value = ct_meta_get(from, keys[k]);

		if (value && ct_meta_set(to, keys[k], value, e))
			return -1;
	}
	return 0;
}
