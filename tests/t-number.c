/* Numbers in text: whole, or none. SPDX-License-Identifier: Apache-2.0 */
#include "config.h"
#include "core/number.h"
#include "core/words.h"
#include "tap.h"

#include <stdint.h>
#include <string.h>

static void test_numbers(void)
{
	static const struct {
		const char *text;
		double is;
	} good[] = {{"0", 0}, {"-0", 0}, {"+12.5", 12.5}, {".5", .5}, {"5.", 5}, {"1e3", 1000},
		{"-1.25E-2", -.0125}, {" 7 ", 7}, {"\t7", 7}, {"1e-400", 0},
		{"000000000000000000000000000001", 1}, {"0.1", .1}};
	static const char *const bad[] = {"", " ", "+", "-", ".", "-.", "e5", "1e", "1e+", "1,5",
		"1.5.", "1.x0", "0x10", "0x1p3", "nan", "NAN", "inf", "-inf", "infinity", "1 2",
		"1;", "--1", "+-1", "- 1", "1e999", "-1e999", "1_000", "1.5f", "1\n"};
	double x = 0;

	for (size_t i = 0; i < sizeof good / sizeof *good; i++)
		OK(ct_number_read(&x, good[i].text) && x == good[i].is, "'%s' is %g", good[i].text,
			good[i].is);
	x = 3;
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
		OK(!ct_number_read(&x, bad[i]) && x == 3, "'%s' is no number", bad[i]);
}

static void test_begin(void)
{
	const char *end, *text = "2.5mm";

	OK(ct_number_begin(text, &end) == 2.5 && strcmp(end, "mm") == 0, "a number and its unit");
	text = "1e5e5";
	OK(ct_number_begin(text, &end) == 1e5 && strcmp(end, "e5") == 0, "one exponent");
	text = " 1";
	OK(isnan(ct_number_begin(text, &end)) && end == text, "it begins with the number");
	text = "x";
	OK(isnan(ct_number_begin(text, &end)) && end == text, "or there is none");
}

static void test_fields(void)
{
	double x = 0;

	OK(ct_number_field(&x, "1.5 \0\0", 6) && x == 1.5, "blanks and zeros end a field");
	OK(!ct_number_field(&x, "-102\0.123", 9), "a zero within makes it none");
	OK(ct_number_field(&x, "12345", 3) && x == 123, "it is as long as it is");
	OK(!ct_number_field(&x, "   ", 3) && !ct_number_field(&x, "", 0), "one of blanks is empty");
}

static void test_whole(void)
{
	long long x = 0;
	uint64_t u = 0;

	OK(ct_number_whole(&x, "-12", -20, 20) && x == -12, "a whole number");
	OK(ct_number_whole(&x, "+7", 0, 20) && x == 7, "with its sign");
	for (const char *const *t = (const char *const[]){"", "-", "1.0", "1e1", "21", "-21", " 1",
		     "1 ", "0x1", "99999999999999999999", NULL};
		*t; t++)
		OK(!ct_number_whole(&x, *t, -20, 20) && x == 7, "'%s' is none from -20 to 20", *t);
	OK(!ct_number_whole(&x, "-1", 0, 9), "no sign below 0");
	OK(ct_number_u64(&u, "18446744073709551615") && u == UINT64_MAX, "64 bits");
	OK(!ct_number_u64(&u, "18446744073709551616") && !ct_number_u64(&u, "-1") &&
			!ct_number_u64(&u, "+1") && !ct_number_u64(&u, "") &&
			!ct_number_u64(&u, "1x"),
		"and no more");
}

static void test_lists(void)
{
	double v[3];

	OK(ct_words_numbers("1,2.5, -3e1", ',', 3, false, v) && v[0] == 1 && v[1] == 2.5 &&
			v[2] == -30,
		"a list of numbers");
	OK(!ct_words_numbers("1,2,0x3", ',', 3, false, v) &&
			!ct_words_numbers("1,nan,3", ',', 3, false, v) &&
			!ct_words_numbers("1,2,3,", ',', 3, false, v) &&
			!ct_words_numbers("1,2.5.,3", ',', 3, false, v),
		"each of them whole");
}

static void test_exact(void)
{
	const char *end;
	double x = 0;

	OK(ct_number_exact(&x, "0x1.8p+1 0x1p+0", &end) && x == 3 && strcmp(end, " 0x1p+0") == 0,
		"a number in hexadecimal, as states have it");
	OK(!ct_number_exact(&x, "inf ", &end) && !ct_number_exact(&x, "nan", &end) &&
			!ct_number_exact(&x, "1,5", &end) && !ct_number_exact(&x, "", &end),
		"finite and whole");
}

int main(void)
{
	test_numbers();
	test_begin();
	test_fields();
	test_whole();
	test_lists();
	test_exact();
	return tap_done();
}
