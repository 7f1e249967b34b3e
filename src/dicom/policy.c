/* policy.c: see image.h. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/number.h"
#include "shim/dicom-file.h"
#include "dicom/image.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>

/* What PS3.15, table E.1-1, has done to an element. */
enum deid {
	KEPT,    /* identifies nobody */
	EMPTIED, /* Z */
	DROPPED, /* X */
	UID,     /* U: another, the same for the same */
	NAMED,   /* D: a name that is none, */
	NUMBERED /* and an ID */
};

enum { NEEDED = 1, SINGLE = 2, FRAMES = 4 }; /* always there; in files of one picture, of many */

static const struct row {
	const char *keyword;
	enum deid deid;
	unsigned where;
} rows[] = {
	{"SpecificCharacterSet", KEPT, SINGLE | FRAMES},
	/* patient */
	{"PatientName", NAMED, NEEDED},
	{"PatientID", NUMBERED, NEEDED},
	{"IssuerOfPatientID", DROPPED, SINGLE | FRAMES},
	{"PatientBirthDate", EMPTIED, NEEDED},
	{"PatientSex", EMPTIED, NEEDED},
	{"PatientAge", DROPPED, SINGLE | FRAMES},
	{"PatientSize", DROPPED, SINGLE | FRAMES},
	{"PatientWeight", DROPPED, SINGLE | FRAMES},
	{"PatientIdentityRemoved", KEPT, SINGLE | FRAMES},
	{"DeidentificationMethod", KEPT, SINGLE | FRAMES},
	/* study */
	{"StudyInstanceUID", UID, SINGLE | FRAMES},
	{"StudyDate", EMPTIED, NEEDED},
	{"StudyTime", EMPTIED, NEEDED},
	{"AccessionNumber", EMPTIED, NEEDED},
	{"ReferringPhysicianName", EMPTIED, NEEDED},
	{"StudyID", EMPTIED, NEEDED},
	{"StudyDescription", DROPPED, SINGLE | FRAMES},
	/* space */
	{"FrameOfReferenceUID", UID, SINGLE | FRAMES},
	{"PositionReferenceIndicator", EMPTIED, NEEDED},
	/* series */
	{"BodyPartExamined", KEPT, SINGLE | FRAMES},
	{"PatientPosition", KEPT, NEEDED},
	{"Laterality", KEPT, SINGLE},
	{"ProtocolName", DROPPED, SINGLE | FRAMES},
	/* how the scan was made */
	{"AcquisitionNumber", KEPT, NEEDED},
	{"AcquisitionDate", DROPPED, SINGLE},
	{"AcquisitionTime", DROPPED, SINGLE},
	{"IrradiationEventUID", UID, SINGLE},
	{"ContrastBolusAgent", EMPTIED, SINGLE},
	{"KVP", KEPT, NEEDED | SINGLE},
	{"ScanOptions", KEPT, SINGLE},
	{"DataCollectionDiameter", KEPT, SINGLE},
	{"ReconstructionDiameter", KEPT, SINGLE},
	{"ExposureTime", KEPT, SINGLE},
	{"XRayTubeCurrent", KEPT, SINGLE},
	{"Exposure", KEPT, SINGLE},
	{"FilterType", KEPT, SINGLE},
	{"FocalSpots", KEPT, SINGLE},
	{"ConvolutionKernel", KEPT, SINGLE},
	/* what cannot be undone */
	{POLICY_LOSSY, KEPT, SINGLE | FRAMES},
	{POLICY_LOSSY "Ratio", KEPT, SINGLE | FRAMES},
	{POLICY_LOSSY "Method", KEPT, SINGLE | FRAMES},
	{POLICY_BURNED, KEPT, SINGLE | FRAMES},
	{"RecognizableVisualFeatures", KEPT, SINGLE | FRAMES},
};

/* Those that protect somebody: what one slice says counts for all, and what some do not say is not
 * known. */
static const struct guard {
	const char *keyword, *worst, *best;
	const char *also; /* words that mean the worst */
} guards[] = {
	{POLICY_BURNED, "YES", "NO", "YES|Y|TRUE|T|1"},
	{"RecognizableVisualFeatures", "YES", "NO", "YES|Y|TRUE|T|1"},
	{POLICY_LOSSY, "01", "00", "01|1|YES|Y|TRUE|T"},
};

static const struct row machine[] = {
	{"Manufacturer", KEPT, 0},
	{"ManufacturerModelName", KEPT, 0},
	{"SoftwareVersions", KEPT, 0},
	{"InstitutionName", DROPPED, 0},
	{"StationName", DROPPED, 0},
	{"DeviceSerialNumber", DROPPED, 0},
};

/* Those that are only looked at. */
static const char *const known[] = {"SeriesNumber", "SeriesDescription", "WindowCenter",
	"WindowWidth", "ContentDate", "ContentTime"};

#define COUNT(a) (sizeof(a) / sizeof *(a))

/* The moment of the content, if it is earlier than `first`, which is empty if there is none yet. */
static void note_moment(char first[40], const struct ct_header *h)
{
	static const char digits[] = "0123456789";
	const char *date = ct_header_get(h, "ContentDate"), *time = ct_header_get(h, "ContentTime");
	char own[40];

	if (!date || !time || strlen(date) != 8 || strspn(date, digits) != 8 || strlen(time) > 16 ||
		strspn(time, digits) != 6)
		return;
	snprintf(own, sizeof own, "%s%s", date, time);
	if (!*first || strcmp(own, first) < 0)
		memcpy(first, own, sizeof own);
}

/* The worst that slices say in the fields of `guards`, and of those that are lossy the ratio and
 * method of the one whose ratio is the largest. */
struct worst {
	bool bad[COUNT(guards)], unknown[COUNT(guards)];
	double ratio;
	char ratios[80], methods[80];
};

/* Codings that always lose something: JPEG, process 1, 2 and 4. */
static bool is_lossy(const struct ct_slice *s)
{
	return strcmp(s->syntax, "1.2.840.10008.1.2.4.50") == 0 ||
	       strcmp(s->syntax, "1.2.840.10008.1.2.4.51") == 0;
}

/* Is one of the values of `text` one of the words? */
static bool has_word(const char *words, const char *text)
{
	for (const char *t = text; *t; t += *t == '\\') {
		const char *begin = t += strspn(t, " ");
		size_t n = strcspn(t, "\\");

		t += n;
		while (n > 0 && begin[n - 1] == ' ')
			n--;
		for (const char *w = words; *w; w += *w == '|') {
			const size_t m = strcspn(w, "|");

			if (m == n && strncasecmp(w, begin, n) == 0)
				return true;
			w += m;
		}
	}
	return false;
}

static void note_worst(struct worst *w, const struct ct_header *h, const struct ct_slice *s)
{
	const char *ratio = ct_header_get(h, POLICY_LOSSY "Ratio"),
		   *method = ct_header_get(h, POLICY_LOSSY "Method");
	const char *end;
	const double most = ratio ? ct_number_begin(ratio, &end) : 0;

	for (size_t i = 0; i < COUNT(guards); i++) {
		const char *text = ct_header_get(h, guards[i].keyword);
		const bool lossy = strcmp(guards[i].keyword, POLICY_LOSSY) == 0 && is_lossy(s);

		w->bad[i] |= lossy || (text && has_word(guards[i].also, text));
		w->unknown[i] |= !text || strcasecmp(text, guards[i].best) != 0;
	}
	if ((!ratio && !method) || most < w->ratio || (most == w->ratio && *w->methods))
		return;
	w->ratio = most;
	snprintf(w->ratios, sizeof w->ratios, "%s", ratio ? ratio : "");
	snprintf(w->methods, sizeof w->methods, "%s", method ? method : "");
}

/* In place of what all slices agree in. */
static void put_worst(struct ct_header *h, const struct worst *w)
{
	ct_header_drop(h, POLICY_LOSSY "Ratio");
	ct_header_drop(h, POLICY_LOSSY "Method");
	for (size_t i = 0; i < COUNT(guards); i++) {
		ct_header_drop(h, guards[i].keyword);
		if (w->bad[i] || !w->unknown[i])
			ct_header_put(h, "", guards[i].keyword, "%s",
				w->bad[i] ? guards[i].worst : guards[i].best);
		if (!w->bad[i] || strcmp(guards[i].keyword, POLICY_LOSSY) != 0)
			continue;
		if (*w->ratios)
			ct_header_put(h, "", POLICY_LOSSY "Ratio", "%s", w->ratios);
		if (*w->methods)
			ct_header_put(h, "", POLICY_LOSSY "Method", "%s", w->methods);
	}
}

int policy_read(struct ct_header *h, const struct ct_slice *s, size_t n, struct ct_err *e)
{
	const char *keyword[COUNT(rows) + COUNT(machine) + COUNT(known)];
	size_t count = 0;
	char first[40] = "";
	struct worst worst = {0};

	for (size_t i = 0; i < COUNT(rows); i++)
		keyword[count++] = rows[i].keyword;
	for (size_t i = 0; i < COUNT(machine); i++)
		keyword[count++] = machine[i].keyword;
	for (size_t i = 0; i < COUNT(known); i++)
		keyword[count++] = known[i];
	for (size_t k = 0; k < n; k++) {
		struct ct_header one = {0};

		if (k > 0 && strcmp(s[k].path, s[k - 1].path) == 0)
			continue; /* another picture of the file */
		if (ct_dicom_header(k ? &one : h, &s[k], count, keyword, e)) {
			ct_header_free(&one);
			return -1;
		}
		note_moment(first, k ? &one : h);
		note_worst(&worst, k ? &one : h, &s[k]);
		if (k > 0)
			ct_header_agree(h, &one);
		ct_header_free(&one);
	}
	if (n > 0)
		put_worst(h, &worst);
	if (*first)
		ct_header_put(h, "", POLICY_CONTENT, "%s", first);
	return ct_header_check(h, e);
}

void policy_uid(char out[CT_UID_TEXT], size_t n, const struct ct_piece *piece)
{
	uint64_t bits[2];

	ct_hash_pieces(bits, n, piece);
	ct_header_uid(out, bits);
}

/* What stands for a UID. */
static void stand_in(char out[CT_UID_TEXT], const char *uid)
{
	static const char what[] = "de-identified";

	policy_uid(out, 2, (const struct ct_piece[]){{what, sizeof what}, {uid, strlen(uid)}});
}

void policy_put_uid(
	struct ct_header *h, const char *in, const char *keyword, const char *uid, bool deid)
{
	char other[CT_UID_TEXT];

	if (deid)
		stand_in(other, uid);
	ct_header_put(h, in, keyword, "%.64s", deid ? other : uid);
}

/* What is left of the text of a row, NULL: nothing; `room` may be used for it. The name goes with
 * the study: a number of the patient would soon be guessed from its hash. */
static const char *leave(
	char room[CT_UID_TEXT], const char *text, const struct row *r, const char *study)
{
	switch (r->deid) {
	case KEPT: return text;
	case EMPTIED: return text ? "" : NULL;
	case DROPPED: return NULL;
	case UID:
		if (!text)
			return NULL;
		stand_in(room, text);
		break;
	case NAMED:
	case NUMBERED:
		stand_in(room, study ? study : "");
		memcpy(room, r->deid == NAMED ? "ANON^" : "ANON-", 5); /* over the "2.25." */
		room[5 + 12] = '\0';
		break;
	}
	return room;
}

static void take(struct ct_header *out, const struct ct_header *from, const struct row *r,
	const char *in, bool deid, bool needed)
{
	const char *text = ct_header_get(from, r->keyword);
	char room[CT_UID_TEXT];

	if (deid)
		text = leave(room, text, r, ct_header_get(from, "StudyInstanceUID"));
	if (text || needed)
		ct_header_put(out, in, r->keyword, "%s", text ? text : "");
}

void policy_take(struct ct_header *out, const struct ct_header *from, bool deid, bool frames)
{
	for (size_t i = 0; i < COUNT(rows); i++) {
		const unsigned kinds = rows[i].where & (SINGLE | FRAMES);

		if (!kinds || kinds & (frames ? FRAMES : SINGLE))
			take(out, from, &rows[i], "", deid, rows[i].where & NEEDED);
	}
}

bool policy_take_machine(
	struct ct_header *out, const struct ct_header *from, const char *in, bool deid)
{
	if (!ct_header_get(from, machine[0].keyword))
		return false;
	for (size_t i = 0; i < COUNT(machine); i++)
		take(out, from, &machine[i], in, deid, false);
	return true;
}
