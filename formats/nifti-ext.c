/* nifti-ext.c: metadata as header extensions, and foreign extensions as metadata. */
#include "config.h"
#include "core/mem.h"
#include "formats/nifti-impl.h"
#include "formats/text.h"

#include <errno.h>
#include <jansson.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { COMMENT = 6, MAX_PAIRS = 4096 };

static const char foreign[] = "nifti.ext.";

/* Our object, or NULL: all keys "ct:...", all values text. */
static json_t *ours(int ecode, const unsigned char *p, size_t bytes)
{
	json_t *o, *value;
	const char *key;
	bool all;

	while (bytes && p[bytes - 1] == 0)
		bytes--;
	if (ecode != COMMENT || !bytes || p[0] != '{')
		return NULL;
	o = json_loadb((const char *)p, bytes, 0, NULL);
	all = o && json_is_object(o) && json_object_size(o) > 0;
	if (all)
		json_object_foreach (o, key, value)
			all = all && strncmp(key, "ct:", 3) == 0 && key[3] && json_is_string(value);
	if (!all) {
		json_decref(o);
		return NULL;
	}
	return o;
}

int ct_nii_ext_read(struct ct_meta *m, size_t *pairs, size_t k, int ecode, const unsigned char *p,
	size_t bytes, struct ct_err *e)
{
	json_t *o = ours(ecode, p, bytes), *value;
	const char *key;
	char name[40], *text;
	int rc = 0, head;

	if (o) {
		*pairs += json_object_size(o);
		if (*pairs > MAX_PAIRS)
			rc = ct_fail(e, CT_EINPUT, "more than %d pairs up to extension %zu",
				MAX_PAIRS, k);
		else
			json_object_foreach (o, key, value)
				if (!rc)
					rc = ct_meta_set(m, key + 3, json_string_value(value), e);
		json_decref(o);
		return rc;
	}
	if (ct_alloc(&text, 16 + CT_TEXT_BASE64(bytes), 1, e))
		return -1;
	snprintf(name, sizeof name, "%s%zu", foreign, k);
	head = snprintf(text, 14, "%d ", ecode);
	ct_text_base64(text + head, p, bytes);
	rc = ct_meta_set(m, name, text, e);
	free(text);
	return rc;
}

/* A copy of prefix + s in which every byte in error is U+FFFD; NULL without memory. */
static char *clean(const char *prefix, const char *s)
{
	char *text = malloc(strlen(prefix) + 3 * strlen(s) + 1), *out = text;

	if (!text)
		return NULL;
	out = stpcpy(out, prefix);
	while (*s) {
		size_t n = ct_text_character(s, 4);

		if (n)
			memcpy(out, s, n);
		else
			memcpy(out, "\xef\xbf\xbd", 3);
		out += n ? n : 3;
		s += n ? n : 1;
	}
	*out = '\0';
	return text;
}

static bool is_foreign(const char *key)
{
	return strncmp(key, foreign, sizeof foreign - 1) == 0;
}

/* One extension, padded with NUL to a multiple of 16 bytes. */
static int append(
	struct ct_nii_head *to, int ecode, const void *data, size_t bytes, struct ct_err *e)
{
	const size_t size = (bytes + 8 + 15) / 16 * 16;
	const uint32_t head[2] = {(uint32_t)size, (uint32_t)ecode};
	unsigned char *at;

	if (size > INT32_MAX)
		return ct_fail(e, CT_EOUTPUT, "metadata of %zu bytes", bytes);
	if (ct_grow(&to->p, &to->cap, to->n + size, 1, e))
		return -1;
	at = to->p + to->n;
	memset(at, 0, size);
	memcpy(at, head, sizeof head);
	memcpy(at + 8, data, bytes);
	to->n += size;
	return 0;
}

static int append_foreign(struct ct_nii_head *to, const struct ct_pair *pair, struct ct_err *e)
{
	unsigned char *bytes;
	size_t count = SIZE_MAX;
	char *end;
	long ecode;
	int rc;

	errno = 0;
	ecode = strtol(pair->value, &end, 10);
	if (ct_alloc(&bytes, strlen(pair->value) + 1, 1, e))
		return -1;
	if (errno == 0 && *end == ' ' && ecode >= INT32_MIN && ecode <= INT32_MAX)
		count = ct_text_of_base64(bytes, end + 1);
	if (count == SIZE_MAX)
		rc = ct_fail(e, CT_EINPUT, "metadata %s is not \"ECODE BASE64\"", pair->key);
	else
		rc = append(to, (int)ecode, bytes, count, e);
	free(bytes);
	return rc;
}

/* The pairs that are ours, as one extension, if there are any. */
static int append_ours(struct ct_nii_head *to, const struct ct_meta *m, struct ct_err *e)
{
	json_t *o = json_object();
	char *text = NULL;
	bool bad = !o;
	int rc = 0;

	for (size_t i = 0; i < m->n && !bad; i++) {
		const char *key = m->pair[i].key;
		char *k, *v;

		if (is_foreign(key) || strcmp(key, CT_META_INPUT) == 0 ||
			strcmp(key, CT_META_NIFTI_CODE) == 0 ||
			strcmp(key, CT_META_NIFTI_DOUBT) == 0)
			continue;
		k = clean("ct:", key);
		v = clean("", m->pair[i].value);
		bad = !k || !v || json_object_set_new(o, k, json_string(v)) != 0;
		free(k);
		free(v);
	}
	if (!bad && json_object_size(o))
		bad = !(text = ct_text_of_json(o, JSON_COMPACT));
	if (bad)
		rc = ct_fail(e, CT_ENOMEM, "no memory for metadata");
	else if (text)
		rc = append(to, COMMENT, text, strlen(text), e);
	free(text);
	json_decref(o);
	return rc;
}

int ct_nii_ext_write(struct ct_nii_head *to, const struct ct_meta *m, struct ct_err *e)
{
	int rc = append_ours(to, m, e);

	for (size_t i = 0; i < m->n && !rc; i++)
		if (is_foreign(m->pair[i].key))
			rc = append_foreign(to, &m->pair[i], e);
	return rc;
}
