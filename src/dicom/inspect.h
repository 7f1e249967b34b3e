/* inspect.h: what is in a folder of DICOM files, before anything is made of it. */
#ifndef CT_DICOM_INSPECT_H
#define CT_DICOM_INSPECT_H
#include "dicom/series.h"

#include <jansson.h>

/* Print the files and series of the paths, as text or, with env->json, as one JSON document, which
 * goes to the end of the array `into` instead if that is not NULL. 0 if series_read would take the
 * series of the rule; else its failure, behind the report. */
int inspect_print(const char *const *paths, size_t n, const struct series_rule *rule, json_t *into,
	const struct ct_env *env, struct ct_err *e);

#endif
