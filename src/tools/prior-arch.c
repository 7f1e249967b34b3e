/* prior-arch.c: see prior-arch.h. */
#include "config.h"
#include "tools/prior-arch.h"

#include <string.h>

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
		int rc = ct_unet_arch_set(a, m->pair[i].key, m->pair[i].value, e);

		if (rc > 0)
			return ct_fail(e, CT_EUSAGE, "--arch: there is no \"%s\"", m->pair[i].key);
		if (rc)
			return -1;
	}
	return ct_unet_arch_check(a, e);
}

int prior_arch_add(struct ct_meta *weights, const struct ct_meta *m, struct ct_err *e)
{
	for (size_t i = 0; i < m->n; i++) {
		const char *key = m->pair[i].key, *value = m->pair[i].value;
		const char *is = ct_meta_get(weights, key);
		struct ct_unet_arch any = {0};
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
