/* json.h: JSON on standard output. SPDX-License-Identifier: Apache-2.0 */
#ifndef CT_CLI_JSON_H
#define CT_CLI_JSON_H
#include "core/err.h"

#include <jansson.h>
#include <stdbool.h>

/* With numbers of so many digits. CT_ENOMEM, also if it is NULL. ct_cli_main looks whether standard
 * output took it. */
int ct_json_print(const json_t *o, unsigned digits, struct ct_err *e);
/* What a command found, an object of numbers and words, which is released: as JSON of 12 digits, or
 * in lines of a name and a value of 6. */
int ct_json_report(json_t *o, bool json, struct ct_err *e);

#endif
