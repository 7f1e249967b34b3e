/* prior-opts.c: see prior-opts.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/installed.h"
#include "formats/format.h"
#include "tools/lib/prior-opts.h"

#include <stdlib.h>
#include <string.h>

int prior_file_read(
	struct ct_slice_prior *prior, struct ct_meta *meta, const char *given, struct ct_err *e)
{
	struct ct_tensors w = {.together = true};
	char *path;
	int rc = -1;

	if (ct_installed_prior(&path, given, PRIOR_SLICES, e))
		return -1;
	if (ct_tensors_read(path, &w, e) == 0) {
		rc = ct_slice_prior_alloc(prior, &w, e) ? ct_blame(e, path) : 0;
		*meta = w.meta;
		w.meta = (struct ct_meta){0};
	}
	ct_tensors_free(&w);
	free(path);
	return rc;
}

int prior_arch_parse(struct ct_meta *m, const char *text, struct ct_err *e)
{
	while (text && *text) {
		size_t len = strcspn(text, ",");
		char item[200], *value;

		if (len >= sizeof item)
			return ct_fail(e, CT_EUSAGE, "--arch: an item is too long");
		memcpy(item, text, len);
		item[len] = '\0';
		text += len + (text[len] == ',');
		value = strchr(item, '=');
		if (!value || value == item)
			return ct_fail(e, CT_EUSAGE, "--arch: \"%s\" is not KEY=VALUE", item);
		*value++ = '\0';
		if (ct_meta_set(m, item, value, e))
			return -1;
	}
	return 0;
}

int prior_arch_set(struct ct_unet_arch *a, const struct ct_meta *m, struct ct_err *e)
{
	for (size_t i = 0; i < m->n; i++) {
		int rc;

		if (strcmp(m->pair[i].key, CT_META_NET) == 0) /* it is set */
			continue;
		rc = ct_unet_arch_set(a, m->pair[i].key, m->pair[i].value, e);
		if (rc > 0)
			return ct_fail(e, CT_EUSAGE, "--arch: there is no \"%s\"", m->pair[i].key);
		if (rc)
			return -1;
	}
	return ct_unet_arch_check(a, e);
}

int prior_arch_add(struct ct_meta *weights, const struct ct_meta *m, struct ct_err *e)
{
	const char *net = ct_meta_get(weights, CT_META_NET);
	struct ct_unet_arch any = {0};

	net = ct_meta_get(m, CT_META_NET) ? ct_meta_get(m, CT_META_NET) : net;
	if (net && ct_unet_arch_set(&any, CT_META_NET, net, e) < 0)
		return -1;
	for (size_t i = 0; i < m->n; i++) {
		const char *key = m->pair[i].key, *value = m->pair[i].value;
		const char *is = ct_meta_get(weights, key);
		int rc = ct_unet_arch_set(&any, key, value, e);

		if (rc < 0)
			return -1;
		if (rc > 0 && strcmp(key, CT_META_BETA_SCHEDULE) != 0 &&
			strcmp(key, CT_META_DIFFUSION_STEPS) != 0)
			return ct_fail(e, CT_EUSAGE, "--arch: there is no \"%s\"", key);
		if (is && strcmp(is, value) != 0)
			return ct_fail(e, CT_EUSAGE, "--arch %s=%s contradicts the file: %.100s",
				key, value, is);
		if (ct_meta_set(weights, key, value, e))
			return -1;
	}
	return 0;
}
